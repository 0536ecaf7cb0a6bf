"""A folder of its own for each run, also for two runs of the same second."""

import itertools
import time
from pathlib import Path

from ja_common.core.config import ConfigError
from ja_common.core.files import why_not_written

RUNS = Path('runs')


def new_run_folder(name: str, parent: Path = RUNS) -> Path:
    """Make the folder `runs/<time>-<name>`, or with a number after the time; return its path.

    Raises ConfigError where it cannot be made.
    """
    now = time.strftime('%Y%m%d-%H%M%S')
    folder = parent / f'{now}-{name}'
    try:
        parent.mkdir(parents=True, exist_ok=True)
        for number in itertools.count(2):
            try:
                folder.mkdir()
            except FileExistsError:  # of another run; that the folder is made decides whose it is
                folder = parent / f'{now}-{number}-{name}'
            else:
                break
    except OSError as error:
        raise ConfigError(why_not_written(folder, error)) from None
    return folder
