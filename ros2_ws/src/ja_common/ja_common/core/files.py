"""Files that are written whole or not at all, and one sentence where they cannot be written."""

import contextlib
import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from ja_common.core.config import ConfigError

_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_NO_PERMISSION = (errno.EACCES, errno.EPERM, errno.EROFS)
_OTHER_KIND = (errno.ENOTDIR, errno.EEXIST, errno.EISDIR)


class SaveError(OSError):
    """A file could not be written; the message says which, why, and what to do."""


@contextmanager
def atomic_file(path: Path) -> Iterator[IO[bytes]]:
    """Open a file to write in the block; at its end it becomes `path`, also if power fails then.

    Folders are made as needed. Until the end `path` is the old file, or none; after an error it
    stays so, and nothing is left of the new one. A link stays a link, and a device is written to
    as it is. Raises SaveError.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and not path.is_file():
            with open(path, 'wb') as device:
                yield device
            return
        target = Path(os.path.realpath(path))
        with _replacement(target) as file:
            yield file
        _sync_folder(target.parent)
    except OSError as error:
        raise SaveError(why_not_written(path, error)) from error


@contextmanager
def _replacement(path: Path) -> Iterator[IO[bytes]]:
    """Open a file beside `path`; rename it to `path` at the end, or remove it after an error."""
    temporary = path.with_name(f'.{path.name}.{os.getpid()}')
    try:
        with open(temporary, 'wb') as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise


def write_file(path: Path, content: bytes | str) -> None:
    """Write a file whole or not at all, a text in UTF-8; see `atomic_file`. Raises SaveError."""
    with atomic_file(path) as file:
        file.write(content.encode() if isinstance(content, str) else content)


def check_writable(folder: Path) -> None:
    """Make a folder, and a file in it for a moment. Raises ConfigError if either is impossible.

    Call it before a long run whose results will be written there.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, prefix='.') as file:
            file.write(bytes(4096))
            file.flush()
    except OSError as error:
        raise ConfigError(why_not_written(folder, error)) from None


def check_file_writable(path: Path) -> None:
    """Raise ConfigError if a file cannot be written: its folder, or what has its name now."""
    if path.is_dir():
        error = OSError(errno.EISDIR, os.strerror(errno.EISDIR))
        raise ConfigError(why_not_written(path, error))
    if path.is_file() or not path.exists():  # a device needs no room in its folder
        check_writable(Path(os.path.realpath(path)).parent)


def why_not_written(path: Path, error: OSError) -> str:
    """Return one sentence about a file or folder that could not be written: why, what to do."""
    why = error.strerror or str(error)
    if error.errno in _NO_SPACE:
        return f'{path} cannot be written ({why}): make room on its disk'
    if error.errno in _NO_PERMISSION:
        return f'{path} cannot be written ({why}): give write permission, or name another place'
    if error.errno in _OTHER_KIND:
        files = (above for above in path.parents if above.exists() and not above.is_dir())
        what = next((f'{file} is no folder' for file in files), 'its name is taken')
        return f'{path} cannot be written ({what}): remove that, or name another place'
    return f'{path} cannot be written ({why}): check its disk, or name another place'


def _sync_folder(folder: Path) -> None:
    # Without this a new name may be lost with the power. Some file systems cannot do it.
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
