"""Compressed files and messages of rosbag2, unpacked within limits.

A file that is compressed as a whole (`x_0.mcap.zstd`) has to be unpacked before a part of it can
be read: into a temporary folder, and never more than half of what is free there.
"""

from __future__ import annotations

import bz2
import gzip
import io
import os
import shutil
import tempfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import lz4.frame
import zstandard

from ja_common.core.config import ConfigError
from ja_recording.core.storage import LARGEST_BYTES, DamagedError

_BLOCK_BYTES = 2**20
_HEAD_BYTES = 32

_ERRORS = (zstandard.ZstdError, RuntimeError, ValueError, OSError, EOFError, zlib.error)


def _open_zstd(stream: IO[bytes]) -> Any:
    return zstandard.ZstdDecompressor().stream_reader(stream, read_across_frames=True)


_Opener = Callable[[IO[bytes]], Any]
# By the first bytes, since names lie: the name of the format, and how it is unpacked.
_FORMATS: dict[bytes, tuple[str, _Opener]] = {
    b'\x28\xb5\x2f\xfd': ('zstd', _open_zstd),
    b'\x04\x22\x4d\x18': ('lz4', lz4.frame.open),
    b'BZh': ('bz2', bz2.open),
    b'\x1f\x8b': ('gzip', gzip.open),
}


def compression_of(head: bytes) -> str:
    """Return the compression that a file or a message with these first bytes has; '' for none."""
    return next((name for magic, (name, _) in _FORMATS.items() if head.startswith(magic)), '')


def unpacked_message(data: bytes) -> bytes:
    """Return the content of a message that may have been compressed by itself.

    rosbag2 does so with `--compression-mode message`, and says it in metadata.yaml alone. CDR
    begins with a byte 0 and no compressed message does, so that nothing needs to be known.
    Raises DamagedError.
    """
    if data[:1] == b'\0' or not (compression := compression_of(data[:4])):
        return data
    try:
        with _open(compression, io.BytesIO(data)) as stream:
            content: bytes = stream.read(LARGEST_BYTES + 1)
    except _ERRORS as error:
        raise DamagedError(f'a message cannot be unpacked ({compression}): {error}') from None
    if len(content) > LARGEST_BYTES:
        raise DamagedError(f'a message unpacks to more than {LARGEST_BYTES} bytes')
    if not content or _named_bytes(data[:_HEAD_BYTES], compression) not in (-1, len(content)):
        raise DamagedError(f'a message was cut short when it was compressed ({compression})')
    return content


def unpack_file(path: Path, folder: Path) -> tuple[Path, str]:
    """Unpack a compressed file into a folder; return its path there, and what is wrong with it.

    A file that was cut short is unpacked as far as it goes. Raises ConfigError when the disk has
    not enough space, or nothing can be unpacked.
    """
    target = folder / (path.stem if path.suffix else f'{path.name}.unpacked')
    problem = ''
    with path.open('rb') as packed:
        head = packed.read(_HEAD_BYTES)
        packed.seek(0)
        compression = compression_of(head)
        named_bytes = _named_bytes(head, compression)
        room = shutil.disk_usage(folder).free // 2
        if named_bytes > room:
            raise _too_large(path, folder, compression)
        try:
            with _open(compression, packed) as stream, target.open('wb') as unpacked:
                _copy(stream, unpacked, room)
        except _ERRORS as error:
            problem = f'it cannot be unpacked to its end ({compression}): {error}'
    written = target.stat().st_size if target.exists() else 0
    if written > room:
        target.unlink()
        raise _too_large(path, folder, compression)
    if not problem and named_bytes > written:
        problem = f'it was cut short: {written} of {named_bytes} bytes are in it'
    if not written:
        raise ConfigError(f'{path} cannot be unpacked ({compression}): {problem or "it is empty"}')
    return target, problem


def _open(compression: str, stream: IO[bytes]) -> Any:
    return dict(_FORMATS.values())[compression](stream)


def _named_bytes(head: bytes, compression: str) -> int:
    """Return the size that a file names for its content; -1 for none."""
    try:
        return zstandard.frame_content_size(head) if compression == 'zstd' else -1
    except zstandard.ZstdError:
        return -1


def _copy(packed: Any, unpacked: IO[bytes], room: int) -> None:
    """Copy until the end, or until there is no room."""
    written = 0
    # Not read(): where a file was cut short, it would lose the block before the error.
    while written <= room and (block := packed.read1(_BLOCK_BYTES)):
        unpacked.write(block)
        written += len(block)


def _too_large(path: Path, folder: Path, compression: str) -> ConfigError:
    return ConfigError(
        f'{path} is compressed ({compression}), and unpacked it takes more than half of what is '
        f'free in {folder.parent}: set TMPDIR to a folder on a larger disk'
    )


def new_folder() -> Path:
    """Make a temporary folder for unpacked files (TMPDIR). Raises ConfigError."""
    try:
        return Path(tempfile.mkdtemp(prefix='recording-'))
    except OSError as error:
        where = os.environ.get('TMPDIR', tempfile.gettempdir())
        raise ConfigError(f'nothing can be unpacked in {where}: {error}') from None
