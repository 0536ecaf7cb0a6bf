"""One MCAP file: what lies where in it, and its messages in the order of publication."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path
from typing import IO

from mcap.records import Channel, Chunk, ChunkIndex, McapRecord, Message, Schema

from ja_recording.core.mcap_records import (
    DamagedError,
    is_mcap,
    records,
    records_in,
    summary_offset,
)

MOST_HELD_BYTES = 2**29
"""Chunks of the same time are in memory at once, for the order of their messages; no more."""

MOST_TOPICS = 1000

LATEST_NS = (2**31 - 1) * 10**9
"""The last time that a ROS stamp can hold, in 2038."""

# What Python needs for a message beside its bytes.
_OBJECT_BYTES = 400


@dataclass(frozen=True)
class Part:
    """A chunk, or a single message outside of chunks: its place, and its first and last stamp.

    `channels`: the channels of its messages; None where they are not known.
    """

    offset: int
    first_ns: int
    last_ns: int
    channels: frozenset[int] | None = None


@dataclass
class McapFile:
    """The parts of a file by their offset, and the channels of its messages by their number.

    `finished`: the recorder has closed the file. `cut_short`: why nothing behind the last part can
    be read, '' when it is the end. `damaged`: what has been left out so far: (offset, reason).
    `schemas`: names of types, by their number.
    """

    path: Path
    finished: bool = True
    cut_short: str = ''
    parts: dict[int, Part] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, str] = field(default_factory=dict)
    damaged: list[tuple[int, str]] = field(default_factory=list)

    def messages(self, channels: Collection[int]) -> Iterator[Message]:
        """Yield the messages of some channels in the order of publication.

        Damaged parts are left out. Raises OSError, and DamagedError when the order would take too
        much memory.
        """
        parts = [
            part
            for part in self.parts.values()
            if part.channels is None or not part.channels.isdisjoint(channels)
        ]
        size = self.path.stat().st_size
        held: list[tuple[int, int, int, Message]] = []
        held_bytes = 0
        with self.path.open('rb') as stream:
            for part in sorted(parts, key=attrgetter('first_ns', 'offset')):
                while held and held[0][0] < part.first_ns:
                    message = heapq.heappop(held)[-1]
                    held_bytes -= len(message.data) + _OBJECT_BYTES
                    yield message
                for number, message in enumerate(self._load(stream, size, part, channels)):
                    heapq.heappush(held, (message.log_time, part.offset, number, message))
                    held_bytes += len(message.data) + _OBJECT_BYTES
                if held_bytes > MOST_HELD_BYTES:
                    raise DamagedError(f'more than {MOST_HELD_BYTES} bytes are of the same time')
            while held:
                yield heapq.heappop(held)[-1]

    def note_record(self, record: McapRecord | None) -> None:
        """Remember a channel or a schema. Raises DamagedError when there are too many."""
        if isinstance(record, Schema):
            self.schemas[record.id] = record.name
        elif isinstance(record, Channel):
            self.channels[record.id] = record
            if len(self.channels) > MOST_TOPICS:
                raise DamagedError(f'it has more than {MOST_TOPICS} topics')

    def _load(
        self, stream: IO[bytes], size: int, part: Part, channels: Collection[int]
    ) -> list[Message]:
        """Return messages of a part; none of a damaged one, whose checksum is over all of it."""
        try:
            content = next(records(stream, size, part.offset)).content
            found = records_in(content) if isinstance(content, Chunk) else [content]
            return [
                record
                for record in found
                if isinstance(record, Message)
                and record.channel_id in channels
                and record.log_time <= LATEST_NS
            ]
        except DamagedError as error:
            self.damaged.append((part.offset, str(error)))
            return []


def read_mcap(path: Path) -> McapFile:
    """Return what a finished file holds, or what is whole of another.

    Raises DamagedError when it is no MCAP file, OSError when it cannot be read.
    """
    size = path.stat().st_size
    with path.open('rb') as stream:
        if not is_mcap(stream):
            raise DamagedError('it is no MCAP file')
        try:
            file = _read_summary(path, stream, size)
        except DamagedError:
            return _scan(path, stream, size, finished=False)
        # The index of the chunks, and the channels in the summary, are optional.
        named = frozenset().union(*(part.channels or () for part in file.parts.values()))
        if file.parts and named <= file.channels.keys():
            return file
        return _scan(path, stream, size, finished=True)


def _read_summary(path: Path, stream: IO[bytes], size: int) -> McapFile:
    file = McapFile(path)
    for record in records(stream, size, summary_offset(stream, size)):
        file.note_record(record.content)
        if isinstance(record.content, ChunkIndex):
            chunk, offset = record.content, record.content.chunk_start_offset
            channels = frozenset(chunk.message_index_offsets) or None
            first_ns, last_ns = chunk.message_start_time, chunk.message_end_time
            file.parts[offset] = Part(offset, first_ns, last_ns, channels)
    return file


def _scan(path: Path, stream: IO[bytes], size: int, finished: bool) -> McapFile:
    """Find all that is whole, chunk by chunk, from the beginning of the file."""
    file = McapFile(path, finished)
    try:
        for record in records(stream, size):
            file.note_record(record.content)
            if isinstance(record.content, Message):
                _note_part(file, record.offset, [record.content])
            elif isinstance(record.content, Chunk):
                _scan_chunk(file, record.offset, record.content)
    except DamagedError as error:
        file.cut_short = str(error)
    return file


def _scan_chunk(file: McapFile, offset: int, chunk: Chunk) -> None:
    messages = []
    try:
        for record in records_in(chunk):
            file.note_record(record)
            if isinstance(record, Message):
                messages.append(Message(record.channel_id, record.log_time, b'', 0, 0))
    except DamagedError as error:
        file.damaged.append((offset, str(error)))
    else:
        _note_part(file, offset, messages)


def _note_part(file: McapFile, offset: int, messages: list[Message]) -> None:
    stamps = [message.log_time for message in messages]
    if stamps:
        channels = frozenset(message.channel_id for message in messages)
        file.parts[offset] = Part(offset, min(stamps), max(stamps), channels)
