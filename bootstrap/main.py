"""`./ja COMMAND`: prepare the environment, then hand over to it."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from bootstrap.machine import clean_environ
from bootstrap.plan import BootstrapError
from bootstrap.setup_environment import Environment


def main(root: Path, args: Sequence[str]) -> None:
    """Prepare the environment and become the command, or end with a sentence; never return."""
    testing = list(args[:1]) == ['test']
    documenting = list(args[:1]) == ['docs']
    environment = Environment(root, os.environ)
    try:
        environment.prepare(dev=testing, docs=testing or documenting)
    except BootstrapError as error:
        sys.exit(f'ja: {error}')
    except KeyboardInterrupt:
        print('\nja: set-up interrupted; the next run goes on from here', file=sys.stderr)
        sys.exit(130)
    if testing:
        os.chdir(root)
        command = ['-m', 'pytest', *args[1:]]
    elif documenting:
        os.chdir(root)
        command = ['-m', 'tools.build_docs', *args[1:]]
    else:
        command = ['-m', 'ja_bringup.cli', *args]
    sys.stdout.flush()
    os.execve(environment.python, [environment.python, *command], clean_environ(os.environ))
