"""Records of an MCAP file: read one at a time, never larger than they may be.

The file comes from anybody, and its lengths may lie. A record is no longer than the file, and a
chunk is unpacked only up to the size that it names, which has a limit.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import IO, Any, NamedTuple

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, Footer, McapRecord, Message, Schema

from ja_recording.core.storage import LARGEST_BYTES, DamagedError

MOST_MESSAGES = 250_000
"""In one chunk: many tiny messages take more memory than their bytes."""

MAGIC = b'\x89MCAP0\r\n'
_HEAD = struct.Struct('<BQ')
_MESSAGE = struct.Struct('<HIQQ')
_FOOTER_BYTES = _HEAD.size + 20 + len(MAGIC)
_CRC_BYTES = 4
_BLOCK_BYTES = 2**20
# The records that are read, and how many bytes of each may be.
_KINDS: dict[int, tuple[Any, int]] = {
    Opcode.SCHEMA: (Schema, 2**20),
    Opcode.CHANNEL: (Channel, 2**16),
    Opcode.MESSAGE: (Message, LARGEST_BYTES),
    Opcode.CHUNK: (Chunk, LARGEST_BYTES),
    Opcode.CHUNK_INDEX: (ChunkIndex, 2**20),
    Opcode.FOOTER: (Footer, 20),
}


class Record(NamedTuple):
    """One record and where it begins; a kind that is not needed has no content."""

    offset: int
    opcode: int
    content: McapRecord | None = None


def records(
    stream: IO[bytes], size: int, offset: int = len(MAGIC), only_heads: bool = False
) -> Iterator[Record]:
    """Yield the records of a file of so many bytes, from an offset on, up to the footer.

    `only_heads`: without their contents. Raises DamagedError at the first that is cut short or
    unreadable.
    """
    while True:
        stream.seek(offset)
        opcode, length = _read_head(stream.read(_HEAD.size))
        end = offset + _HEAD.size + length
        if end > size:
            raise DamagedError('it was cut short')
        content = None
        if opcode in _KINDS and not only_heads:
            _check_length(opcode, length)
            content = _parsed(opcode, stream.read(length))
        yield Record(offset, opcode, content)
        if opcode == Opcode.FOOTER:
            return
        offset = end


def read_footer(stream: IO[bytes], size: int) -> Footer | None:
    """Return the footer of a file; None where the file was not finished."""
    if size < len(MAGIC) + _FOOTER_BYTES:
        return None
    stream.seek(size - len(MAGIC))
    if stream.read() != MAGIC:
        return None
    try:
        found = next(records(stream, size, size - _FOOTER_BYTES)).content
    except DamagedError:
        return None
    return found if isinstance(found, Footer) else None


def check_summary(footer: Footer, stream: IO[bytes], size: int) -> None:
    """Compare the checksum of a summary, where there is one. Raises DamagedError."""
    end = size - len(MAGIC) - _CRC_BYTES
    if footer.summary_crc not in (0, _checksum(stream, footer.summary_start, end)):
        raise DamagedError('the checksum of its summary is wrong')


def records_in(chunk: Chunk) -> Iterator[McapRecord]:
    """Yield the schemas, channels and messages of a chunk. Raises DamagedError."""
    data = _unpacked(chunk)
    offset = messages = 0
    while offset < len(data):
        opcode, length = _read_head(data[offset : offset + _HEAD.size])
        offset += _HEAD.size
        if length > len(data) - offset:
            raise DamagedError('a message of a chunk is longer than the chunk')
        messages += opcode == Opcode.MESSAGE
        if messages > MOST_MESSAGES:
            raise DamagedError(f'a chunk holds more than {MOST_MESSAGES} messages')
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
            _check_length(opcode, length)
            yield _parsed(opcode, data[offset : offset + length])
        offset += length


def _read_head(head: bytes) -> tuple[int, int]:
    if len(head) < _HEAD.size:
        raise DamagedError('it was cut short')
    opcode, length = _HEAD.unpack(head)
    return opcode, length


def _checksum(stream: IO[bytes], start: int, end: int) -> int:
    stream.seek(start)
    checksum = 0
    for offset in range(start, end, _BLOCK_BYTES):
        checksum = zlib.crc32(stream.read(min(_BLOCK_BYTES, end - offset)), checksum)
    return checksum


def _check_length(opcode: int, length: int) -> None:
    kind, largest = _KINDS[opcode]
    if length > largest:
        raise DamagedError(f'a {kind.__name__} of {length} bytes is longer than {largest}')


def _parsed(opcode: int, content: bytes) -> McapRecord:
    try:
        if opcode == Opcode.MESSAGE:
            # Faster than mcap's, and a message may be empty.
            channel_id, sequence, log_time, publish_time = _MESSAGE.unpack_from(content)
            data = content[_MESSAGE.size :]
            return Message(channel_id, log_time, data, publish_time, sequence)
        return _KINDS[opcode][0].read(ReadDataStream(BytesIO(content)))
    except (McapError, struct.error, ValueError, OverflowError) as error:
        raise DamagedError(f'a record is damaged: {error}') from None


def _unpacked(chunk: Chunk) -> bytes:
    """Return the content of a chunk, checked against its size and its checksum."""
    size = chunk.uncompressed_size
    if size > LARGEST_BYTES:
        raise DamagedError(f'a chunk of {size} bytes is larger than {LARGEST_BYTES}')
    try:
        data = _UNPACK[chunk.compression](chunk.data, size)
    except KeyError:
        raise DamagedError(f'its compression {chunk.compression[:20]!r} is not known') from None
    except (zstandard.ZstdError, RuntimeError, ValueError, MemoryError, EOFError) as error:
        raise DamagedError(f'a chunk cannot be unpacked: {error}') from None
    if len(data) != size:
        raise DamagedError(f'a chunk of {size} bytes holds another number')
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise DamagedError('the checksum of a chunk is wrong')
    return data


def _unpack_zstd(data: bytes, size: int) -> bytes:
    # A frame that names its size is unpacked to that size, whatever limit is given.
    if zstandard.frame_content_size(data) not in (-1, size):
        raise ValueError('it names two sizes')
    return zstandard.ZstdDecompressor().decompress(data, max_output_size=size) if size else b''


def _unpack_lz4(data: bytes, size: int) -> bytes:
    # One byte more, so that a longer content shows.
    return lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)


_UNPACK = {'': lambda data, _: data, 'zstd': _unpack_zstd, 'lz4': _unpack_lz4}
