"""Where libraries keep their files on a machine without a home folder that can be written."""

import os
import stat
import tempfile
from collections.abc import MutableMapping
from pathlib import Path

_ROS_LOGS = Path('.ros') / 'log'
_FOLDERS = {'ROS_LOG_DIR': 'log', 'NUMBA_CACHE_DIR': 'numba', 'MPLCONFIGDIR': 'matplotlib'}


def replace_missing_home(environ: MutableMapping[str, str] = os.environ) -> None:
    """Name other folders where the home folder is missing, read-only or full.

    ROS starts no node without a folder for its logs. What the user has set stays.
    """
    home = environ.get('HOME')
    if environ.get('ROS_LOG_DIR') or environ.get('ROS_HOME') or (home and _is_usable(Path(home))):
        return
    folder = _private_folder()
    for variable, name in _FOLDERS.items():
        if not environ.get(variable):
            environ[variable] = str(folder / name)


def _is_usable(home: Path) -> bool:
    try:
        (home / _ROS_LOGS).mkdir(parents=True, exist_ok=True)  # as ROS does
    except OSError:
        return False
    return os.access(home / _ROS_LOGS, os.W_OK)


def _private_folder() -> Path:
    """Return a folder for temporary files that no other user can have prepared."""
    folder = Path(tempfile.gettempdir()) / f'joint-attention-{os.getuid()}'
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if found.st_uid == os.getuid() and stat.S_IMODE(found.st_mode) == 0o700:
            return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix='joint-attention-'))
