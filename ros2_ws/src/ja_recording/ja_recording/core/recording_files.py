"""Which files make up a recording, and which kind each of them is."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

from ja_common.core.config import ConfigError
from ja_recording.core import db3_file
from ja_recording.core.bag_metadata import NAME, BagMetadata, read_metadata
from ja_recording.core.db3_file import Db3File
from ja_recording.core.mcap_file import read_mcap
from ja_recording.core.mcap_records import MAGIC
from ja_recording.core.storage import DamagedError, StorageFile
from ja_recording.core.unpacking import compression_of, unpack_file

_STORAGES = ('.mcap', '.db3')
_PACKED = ('', '.zstd', '.zst', '.lz4', '.bz2', '.gz')
_HEAD_BYTES = 64

# What a file is that is no recording, by its first bytes, and what to do.
_FOREIGN = {
    b'': 'it is empty',
    b'PK\x03\x04': 'it is a zip archive: unpack it first',
    b'\xfd7zXZ': 'it is compressed with xz: unpack it first (xz -dk FILE)',
    b'version https://git-lfs': 'it is a pointer of Git LFS, not the file itself: `git lfs pull`',
    b'<!DOCTYPE': 'it is a web page: the download went wrong',
    b'<html': 'it is a web page: the download went wrong',
}


@dataclass(frozen=True)
class RecordingFiles:
    """The files of a recording; the types that its metadata names; what is odd about them."""

    paths: list[Path]
    types: dict[str, str] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)


def find_files(path: Path) -> RecordingFiles:
    """Return the files of a recording that is given as a file, a folder, or its metadata.yaml.

    Raises ConfigError with what is there instead.
    """
    if path.is_dir():
        return _in_folder(path)
    if not path.is_file():
        raise ConfigError(f'{path}: no recording (.mcap, .db3, or a folder of them) there')
    if path.name == NAME:
        return _in_folder(path.parent)
    return RecordingFiles([path], read_metadata(path.parent).types)


def open_file(path: Path, make_folder: Callable[[], Path]) -> tuple[StorageFile, str]:
    """Open a file as what its first bytes say it is; return it, and what is wrong with it.

    A compressed file is unpacked in the folder that `make_folder` returns. Raises ConfigError.
    """
    packed, problem = path, ''
    try:
        head = _head(path)
        if compression_of(head):
            path, problem = unpack_file(packed, make_folder())
            head = _head(path)
        if head.startswith(MAGIC):
            return read_mcap(path), problem
        if head.startswith(db3_file.MAGIC):
            return Db3File(path), problem
    except (DamagedError, OSError) as error:
        raise ConfigError(f'{packed} cannot be read: {error}') from None
    raise ConfigError(f'{packed} cannot be read: {_foreign(packed, head)}')


def _foreign(path: Path, head: bytes) -> str:
    if head.startswith(b'#ROSBAG'):
        return f'it is a recording of ROS 1. {_conversion_of_ros1(path)}'
    known = (why for magic, why in _FOREIGN.items() if magic and head.startswith(magic))
    return next(known, _FOREIGN[b''] if not head else 'it is neither MCAP nor SQLite')


def _conversion_of_ros1(path: Path) -> str:
    source, target = (shlex.quote(str(each)) for each in (path, path.with_suffix('')))
    return (
        f'Convert it first: `pip install rosbags`, then `rosbags-convert --src {source} '
        f'--dst {target} --dst-storage mcap --dst-typestore ros2_jazzy`, and name {target}'
    )


def _head(path: Path) -> bytes:
    with path.open('rb') as stream:
        return stream.read(_HEAD_BYTES)


def _in_folder(folder: Path) -> RecordingFiles:
    metadata = read_metadata(folder)
    remarks = [metadata.problem] if metadata.problem else []
    there = _without_packed_twins(
        path for path in folder.iterdir() if _storage(path) and not path.name.startswith('.')
    )
    listed = _listed(folder, metadata, remarks)
    kinds = {_storage(path) for path in listed} or {_storage(path) for path in there}
    if len(kinds) > 1:
        names = ', '.join(sorted(path.name for path in there)[:4])
        raise ConfigError(f'{folder} holds recordings of several formats: name one of {names}')
    twins = {_unpacked_name(path) for path in listed}
    if listed:
        others = (path for path in there if _storage(path) not in kinds)
        remarks += [f'{path} is not read: {folder / NAME} does not name it' for path in others]
    more = [
        path for path in there if _storage(path) in kinds and _unpacked_name(path) not in twins
    ]
    paths = [*listed, *more]
    if not paths:
        raise ConfigError(_why_none(folder, metadata))
    return RecordingFiles(sorted(paths, key=_order_in_folder), metadata.types, remarks)


def _listed(folder: Path, metadata: BagMetadata, remarks: list[str]) -> list[Path]:
    """Return the files that the metadata names; one may have been packed or unpacked since."""
    found = []
    for name in metadata.files:
        plain = _unpacked_name(Path(name))
        names = dict.fromkeys((plain, name, *(plain + packed for packed in _PACKED)))
        known = [folder / each for each in names if (folder / each).is_file()]
        if known:
            found.append(known[0])
        else:
            remarks.append(f'{folder / name} is not there, although {NAME} names it')
    return found


def _without_packed_twins(paths: Iterable[Path]) -> list[Path]:
    """Return the files, but not those that lie there unpacked as well: `ros2 bag` leaves both."""
    plain_first = sorted(paths, key=lambda path: (len(path.name), path.name))
    known: dict[str, Path] = {}
    for path in plain_first:
        known.setdefault(_unpacked_name(path), path)
    return sorted(known.values())


def _storage(path: Path) -> str:
    """Return `.mcap` or `.db3`, of a compressed file as well; '' for another file."""
    suffix = Path(_unpacked_name(path)).suffix
    return suffix if suffix in _STORAGES else ''


def _unpacked_name(path: Path) -> str:
    return path.stem if path.suffix in _PACKED[1:] else path.name


def _why_none(folder: Path, metadata: BagMetadata) -> str:
    if bags := sorted(folder.glob('*.bag')):
        return f'{bags[0]} is a recording of ROS 1. {_conversion_of_ros1(bags[0])}'
    deeper = sorted(path.name for path in folder.iterdir() if path.is_dir() and _holds_any(path))
    if deeper:
        return f'{folder}: no recording there, but below it: name one of {", ".join(deeper[:5])}'
    if metadata.storage not in ('', 'mcap', 'sqlite3'):
        options = "'output_bags: [{uri: converted, storage_id: mcap, all: true}]'"
        return (
            f'{folder} is a recording of the storage {metadata.storage[:50]!r}. Convert it first, '
            f'where that is installed: `echo {options} > out.yaml`, then '
            f'`ros2 bag convert -i {shlex.quote(str(folder))} -o out.yaml`, and name `converted`'
        )
    return f'{folder}: no recording (.mcap or .db3) there'


def _holds_any(folder: Path) -> bool:
    try:
        return any(_storage(path) for path in folder.iterdir())
    except OSError:
        return False


def _order_in_folder(path: Path) -> tuple[int, str]:
    last = Path(_unpacked_name(path)).stem.rpartition('_')[2]
    return (int(last) if last.isdecimal() else 0, path.name)
