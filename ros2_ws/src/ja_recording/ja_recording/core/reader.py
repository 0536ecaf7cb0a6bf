"""Read recordings: MCAP files of any ROS 2 recorder, unfinished files included."""

import io
import struct
import sys
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.summary import Summary
from zstandard import ZstdError

from ja_common.core.config import ConfigError

# What a file that ends in the middle of a record, or of a chunk, can raise.
_CUT_SHORT = (McapError, ZstdError, struct.error, EOFError, ValueError)


@dataclass(frozen=True)
class RecordedTopic:
    """A topic of a recording; `offered_qos` is rosbag2's YAML, '' if it is not in the file."""

    name: str
    type_name: str
    offered_qos: str


@dataclass(frozen=True)
class RecordedMessage:
    """One message: CDR bytes, and its time of publication (wall clock) [ns]."""

    topic: RecordedTopic
    stamp_ns: int
    data: bytes


class Recording:
    """A file, or a folder of files in the order of their numbers.

    `unfinished`: files whose recorder ended without closing them. Raises ConfigError when there
    is no file, or when one is not an MCAP file of ROS 2 messages.
    """

    def __init__(self, path: Path) -> None:
        self._paths = (
            sorted(path.glob('*.mcap'), key=_order_in_folder) if path.is_dir() else [path]
        )
        if not self._paths or not all(each.is_file() for each in self._paths):
            raise ConfigError(f'{path}: no recording (.mcap) there')
        files = [_McapFile(each) for each in self._paths]
        self.unfinished = [file.path for file in files if file.unfinished]
        self.topics: dict[str, RecordedTopic] = {}
        for file in files:
            self.topics |= {topic.name: topic for topic in file.topics()}
        spans = [span for file in files if (span := file.span())]
        self.first_ns = min((span[0] for span in spans), default=0)
        self.last_ns = max((span[1] for span in spans), default=0)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[RecordedMessage]:
        """Yield the messages of some topics (None: all) in the order of publication."""
        for path in self._paths:
            yield from _McapFile(path).messages(topics)


def warn_of_unfinished(recording: Recording) -> None:
    """Print, on stderr, which files their recorder did not close."""
    for path in recording.unfinished:
        print(f'{path} was not closed: it is read up to its last whole message', file=sys.stderr)


class _McapFile:
    def __init__(self, path: Path) -> None:
        self.path = path
        self._summary = self._read_summary()
        self.unfinished = self._summary is None
        self._salvaged = self._salvage() if self._summary is None else []

    def topics(self) -> Iterator[RecordedTopic]:
        if self._summary is None:
            yield from {message.topic.name: message.topic for message in self._salvaged}.values()
            return
        for channel in self._summary.channels.values():
            yield _topic(self._summary.schemas.get(channel.schema_id), channel)

    def span(self) -> tuple[int, int] | None:
        if self._summary is None:
            stamps = [message.stamp_ns for message in self._salvaged]
            return (stamps[0], stamps[-1]) if stamps else None
        found = self._summary.statistics
        if found is None or not found.message_count:
            return None
        return found.message_start_time, found.message_end_time

    def messages(self, topics: Collection[str] | None) -> Iterator[RecordedMessage]:
        if self._summary is None:
            chosen = (m for m in self._salvaged if topics is None or m.topic.name in topics)
            yield from chosen
            return
        known: dict[int, RecordedTopic] = {}
        with self.path.open('rb') as stream:
            for schema, channel, message in SeekingReader(stream).iter_messages(topics):
                if channel.id not in known:
                    known[channel.id] = _topic(schema, channel)
                yield RecordedMessage(known[channel.id], message.log_time, message.data)

    def _read_summary(self) -> Summary | None:
        try:
            with self.path.open('rb') as stream:
                return SeekingReader(stream).get_summary()
        except _CUT_SHORT:
            return None

    def _salvage(self) -> list[RecordedMessage]:
        """Return all whole messages, in order, in memory: the file is one split at most."""
        schemas: dict[int, Schema] = {}
        topics: dict[int, RecordedTopic] = {}
        messages: list[RecordedMessage] = []
        stream = io.BytesIO(self.path.read_bytes())
        try:
            for record in StreamReader(stream).records:
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    topics[record.id] = _topic(schemas.get(record.schema_id), record)
                elif isinstance(record, Message):
                    message = RecordedMessage(
                        topics[record.channel_id], record.log_time, record.data
                    )
                    messages.append(message)
        except _CUT_SHORT as error:
            if not messages:
                raise ConfigError(
                    f'{self.path}: no message can be read from it: {error}'
                ) from None
        return sorted(messages, key=lambda message: message.stamp_ns)


def _topic(schema: Schema | None, channel: Channel) -> RecordedTopic:
    if schema is None or channel.message_encoding != 'cdr':
        raise ConfigError(f'{channel.topic} is not recorded as a ROS 2 message (CDR)')
    offered = channel.metadata.get('offered_qos_profiles', '')
    return RecordedTopic(channel.topic, schema.name, offered)


def _order_in_folder(path: Path) -> tuple[int, str]:
    last = path.stem.rpartition('_')[2]
    return (int(last) if last.isdecimal() else 0, path.name)
