"""`./ja COMMAND`: prepare the environment, then hand over to it."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from bootstrap.machine import clean_environ
from bootstrap.plan import BootstrapError
from bootstrap.setup_environment import Environment
from bootstrap.shared_memory import check_shared_memory


def main(root: Path, args: Sequence[str]) -> None:
    """Prepare the environment and become the command, or end with a sentence; never return."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    testing = list(args[:1]) == ['test']
    documenting = list(args[:1]) == ['docs']
    environment = Environment(root, os.environ)
    try:
        environment.prepare(dev=testing, docs=testing or documenting)
        check_shared_memory()
    except BootstrapError as error:
        sys.exit(f'ja: {error}')
    except KeyboardInterrupt:
        print('\nja: set-up interrupted; the next run goes on from here', file=sys.stderr)
        sys.exit(130)
    if testing:
        os.chdir(root)
        # All tests: in as many processes as there are processors. Chosen ones: as they are.
        parallel = [] if args[1:] else ['-n', 'auto', '--maxprocesses', '4']
        command = ['-m', 'pytest', *parallel, *args[1:]]
    elif documenting:
        os.chdir(root)
        command = ['-m', 'tools.build_docs', *args[1:]]
    else:
        # The installed script: `-m` would search the current folder for every import.
        command = [environment.script, *args]
        # Python has a handler for SIGINT before any line of ours, and would end an import with a
        # traceback; `ja_bringup.__main__` lets the signal through.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    sys.stdout.flush()
    os.execve(environment.python, [environment.python, *command], clean_environ(os.environ))
