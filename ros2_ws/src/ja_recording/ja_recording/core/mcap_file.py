"""One MCAP file: what lies where in it, and its messages in the order of publication."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path
from typing import IO

from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, Footer, McapRecord, Message, Schema

from ja_recording.core.mcap_records import (
    Record,
    check_summary,
    read_footer,
    records,
    records_in,
)
from ja_recording.core.storage import (
    LATEST_NS,
    MOST_TOPICS,
    DamagedError,
    StoredChannel,
    StoredMessage,
)

MOST_HELD_BYTES = 2**29
"""Chunks of the same time are in memory at once, for the order of their messages; no more."""

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

    `schemas`: names of types, by their number. The others as in `StorageFile`.
    """

    path: Path
    finished: bool = True
    cut_short: str = ''
    parts: dict[int, Part] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, str] = field(default_factory=dict)
    damaged: list[tuple[str, str]] = field(default_factory=list)

    @property
    def stored_channels(self) -> dict[int, StoredChannel]:
        """Return the channels by their number, those included that only messages name."""
        named = {
            number: StoredChannel(
                channel.topic,
                self.schemas.get(channel.schema_id, ''),
                channel.message_encoding,
                channel.metadata.get('offered_qos_profiles', ''),
            )
            for number, channel in self.channels.items()
        }
        unnamed = self._numbers_in_parts() - named.keys()
        return named | {number: StoredChannel('', '', '') for number in sorted(unnamed)}

    @property
    def span_ns(self) -> tuple[int, int] | None:
        """Return the first and the last stamp; None without messages."""
        if not self.parts:
            return None
        first_ns = min(part.first_ns for part in self.parts.values())
        last_ns = max(part.last_ns for part in self.parts.values())
        return min(first_ns, LATEST_NS), min(last_ns, LATEST_NS)

    @property
    def is_whole(self) -> bool:
        """Return whether every part has a time and channels, and every channel a type.

        All of these are optional in a summary.
        """
        wanted = {channel.schema_id for channel in self.channels.values()} - {0}
        return (
            bool(self.parts)
            and all(part.last_ns and part.channels for part in self.parts.values())
            and self._numbers_in_parts() <= self.channels.keys()
            and wanted <= self.schemas.keys()
        )

    def messages(self, channels: Collection[int]) -> Iterator[StoredMessage]:
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
                    yield _stored(message)
                for number, message in enumerate(self._load(stream, size, part, channels)):
                    heapq.heappush(held, (message.log_time, part.offset, number, message))
                    held_bytes += len(message.data) + _OBJECT_BYTES
                if held_bytes > MOST_HELD_BYTES:
                    raise DamagedError(
                        f'more than {MOST_HELD_BYTES} bytes are of the same time, '
                        f'{part.first_ns} ns: their recorder gave them no times of their own'
                    )
            while held:
                yield _stored(heapq.heappop(held)[-1])

    def note_record(self, record: McapRecord | None) -> None:
        """Remember a channel or a schema. Raises DamagedError when there are too many."""
        if isinstance(record, Schema):
            self.schemas[record.id] = record.name
        elif isinstance(record, Channel):
            self.channels[record.id] = record
            if len(self.channels) > MOST_TOPICS:
                raise DamagedError(f'it has more than {MOST_TOPICS} topics')

    def _numbers_in_parts(self) -> frozenset[int]:
        return frozenset().union(*(part.channels or () for part in self.parts.values()))

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
            self.damaged.append((f'byte {part.offset}', str(error)))
            return []


def read_mcap(path: Path) -> McapFile:
    """Return what a finished file holds, or what is whole of another.

    Raises OSError when it cannot be read.
    """
    size = path.stat().st_size
    with path.open('rb') as stream:
        footer = read_footer(stream, size)
        if footer is not None and footer.summary_start:
            try:
                file = _read_summary(path, stream, size, footer)
            except DamagedError:
                pass  # the same can be found without it
            else:
                if file.is_whole:
                    return file
        return _scan(path, stream, size, finished=footer is not None)


def _read_summary(path: Path, stream: IO[bytes], size: int, footer: Footer) -> McapFile:
    check_summary(footer, stream, size)
    file = McapFile(path)
    for record in records(stream, size, footer.summary_start):
        file.note_record(record.content)
        if isinstance(record.content, ChunkIndex):
            chunk, offset = record.content, record.content.chunk_start_offset
            channels = frozenset(chunk.message_index_offsets) or None
            first_ns, last_ns = chunk.message_start_time, chunk.message_end_time
            file.parts[offset] = Part(offset, first_ns, last_ns, channels)
    if file.is_whole:
        _find_unindexed(file, stream, size)
    return file


def _find_unindexed(file: McapFile, stream: IO[bytes], size: int) -> None:
    """Add what is in the file but not in its index: it may be of some chunks only."""
    indexed = 0
    others: list[int] = []
    try:
        for record in records(stream, size, only_heads=True):
            if record.offset in file.parts:
                indexed += 1
            elif record.opcode in (Opcode.CHUNK, Opcode.MESSAGE):
                others.append(record.offset)
    except DamagedError:
        return  # a damaged length: what follows has to be found by the index
    if indexed < len(file.parts):
        return  # the walk has been led astray
    for offset in others:
        _note_content(file, next(records(stream, size, offset)))


def _scan(path: Path, stream: IO[bytes], size: int, finished: bool) -> McapFile:
    """Find all that is whole, chunk by chunk, from the beginning of the file."""
    file = McapFile(path, finished)
    try:
        for record in records(stream, size):
            file.note_record(record.content)
            _note_content(file, record)
    except DamagedError as error:
        file.cut_short = str(error)
    else:
        file.finished = True  # something else follows the footer
    return file


def _note_content(file: McapFile, record: Record) -> None:
    """Remember a part of a file, if the record is one."""
    if isinstance(record.content, Message):
        _note_part(file, record.offset, [record.content])
    elif isinstance(record.content, Chunk):
        _scan_chunk(file, record.offset, record.content)


def _stored(message: Message) -> StoredMessage:
    return StoredMessage(message.channel_id, message.log_time, message.data)


def _scan_chunk(file: McapFile, offset: int, chunk: Chunk) -> None:
    messages = []
    try:
        for record in records_in(chunk):
            file.note_record(record)
            if isinstance(record, Message):
                messages.append(Message(record.channel_id, record.log_time, b'', 0, 0))
    except DamagedError as error:
        file.damaged.append((f'byte {offset}', str(error)))
    else:
        _note_part(file, offset, messages)


def _note_part(file: McapFile, offset: int, messages: list[Message]) -> None:
    stamps = [message.log_time for message in messages]
    if stamps:
        channels = frozenset(message.channel_id for message in messages)
        file.parts[offset] = Part(offset, min(stamps), max(stamps), channels)
