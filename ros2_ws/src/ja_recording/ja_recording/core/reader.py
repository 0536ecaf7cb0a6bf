"""Read recordings of any ROS 2 recorder, unfinished and damaged files included.

A recording holds what its graph had, not what we know: a channel that cannot be read is left out
with one remark, and the others are read.
"""

from __future__ import annotations

import heapq
import re
import shutil
import sys
import weakref
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from ja_common.core.config import ConfigError
from ja_recording.core.recording_files import find_files, open_file
from ja_recording.core.storage import (
    MOST_TOPICS,
    DamagedError,
    StorageFile,
    StoredChannel,
)
from ja_recording.core.unpacking import new_folder, unpacked_message

_TOPIC = re.compile(r'(/[A-Za-z_][A-Za-z0-9_]*)+')
# Some writers name types as ROS 1 does: `std_msgs/String`.
_SHORT_TYPE = re.compile(r'[a-z][a-z0-9_]*/[A-Z][A-Za-z0-9]*')
_MOST_OPEN_FILES = 200
_MOST_REMARKS = 20


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


@dataclass
class _OpenedFile:
    """A file by the name that was given (it may lie unpacked elsewhere), and its topics."""

    path: Path
    storage: StorageFile
    topics: dict[int, RecordedTopic]


class Recording:
    """A file, or a folder of files, whose messages are read in the order of their times.

    `without`: topics that are left out before anything of them is looked at. `topics`: the others
    by name. `left_out`: why a channel cannot be read, by its name. `unfinished`: files whose
    recorder ended without closing them. `remarks`: one sentence for each thing that a user should
    know. Raises ConfigError when there is no file, when one cannot be read, when no topic is left,
    and for a name in `without` that the recording does not hold.
    """

    def __init__(self, path: Path, without: Collection[str] = ()) -> None:
        self._path = path
        self._unpacked_in: Path | None = None
        found = find_files(path)
        self.remarks = list(found.remarks)
        self._types = found.types
        self._without = {f'/{name.strip().lstrip("/")}' for name in without if name.strip()}
        self.topics: dict[str, RecordedTopic] = {}
        self.left_out: dict[str, str] = {}
        self._files = [self._open(each) for each in found.paths]
        self.unfinished = [file.path for file in self._files if not file.storage.finished]
        self._check_topics()
        spans = [file.storage.span_ns for file in self._files]
        self.first_ns = min((span[0] for span in spans if span), default=0)
        self.last_ns = max((span[1] for span in spans if span), default=0)
        self._remark_on_files(any(spans))

    def messages(self, topics: Collection[str] | None = None) -> Iterator[RecordedMessage]:
        """Yield the messages of some topics (None: all) in the order of their times.

        Damaged parts are left out, and named on stderr at the end. Raises ConfigError when a file
        cannot be read.
        """
        waiting = [
            (span[0], order, file)
            for order, file in enumerate(self._files)
            if (span := file.storage.span_ns)
        ]
        waiting.sort(key=lambda each: each[:2], reverse=True)
        opened: list[tuple[int, int, RecordedMessage, Iterator[RecordedMessage]]] = []
        while waiting or opened:
            # A file is opened when its time comes: split recordings have many.
            if waiting and (not opened or waiting[-1][0] <= opened[0][0]):
                _, order, file = waiting.pop()
                messages = self._messages_of(file, topics)
                if len(opened) == _MOST_OPEN_FILES:
                    raise ConfigError(
                        f'{self._path}: more than {_MOST_OPEN_FILES} files are of the same time'
                    )
            else:
                _, order, message, messages = heapq.heappop(opened)
                yield message
            if (following := next(messages, None)) is not None:
                heapq.heappush(opened, (following.stamp_ns, order, following, messages))

    def _messages_of(
        self, file: _OpenedFile, topics: Collection[str] | None
    ) -> Iterator[RecordedMessage]:
        storage = file.storage
        topic_of = {
            number: topic
            for number, topic in file.topics.items()
            if topics is None or topic.name in topics
        }
        try:
            for channel, stamp_ns, data in storage.messages(topic_of.keys()):
                topic = topic_of[channel]
                try:
                    yield RecordedMessage(topic, stamp_ns, unpacked_message(data))
                except DamagedError as error:
                    storage.damaged.append((f'{topic.name} {stamp_ns} ns', str(error)))
        except (DamagedError, OSError) as error:
            raise ConfigError(f'{file.path} cannot be read: {error}') from None
        _warn_of_damage(file)

    def _open(self, path: Path) -> _OpenedFile:
        storage, problem = open_file(path, self._unpack_folder)
        why = [*filter(None, [problem, storage.cut_short]), *(why for _, why in storage.damaged)]
        if why and storage.span_ns is None:
            raise ConfigError(f'{path}: no message can be read from it: {why[0]}')
        if problem:
            self.remarks.append(f'{path}: {problem}')
        file = _OpenedFile(path, storage, {})
        for number, channel in storage.stored_channels.items():
            self._take_channel(file, number, channel)
        return file

    def _take_channel(self, file: _OpenedFile, number: int, channel: StoredChannel) -> None:
        name = channel.topic
        if name in self._without:
            return
        type_name = channel.type_name or self._types.get(name, '')
        if _SHORT_TYPE.fullmatch(type_name):
            type_name = type_name.replace('/', '/msg/')
        known = self.topics.get(name)
        if known is not None and known.type_name != type_name:
            why = f'it has messages of a second type, {type_name[:100] or "unknown"}'
        else:
            why = _why_unreadable(number, channel, type_name)
        if why:
            self.left_out.setdefault(_label(number, name), why)
        else:
            file.topics[number] = RecordedTopic(name, type_name, channel.offered_qos)
            self.topics[name] = file.topics[number]

    def _check_topics(self) -> None:
        stored = (file.storage.stored_channels for file in self._files)
        names = {channel.topic for channels in stored for channel in channels.values()}
        if unknown := sorted(self._without - names):
            there = ', '.join(sorted(self.topics))
            raise ConfigError(f'no topic {", ".join(unknown)} in the recording; it holds: {there}')
        if len(self.topics) > MOST_TOPICS:
            raise ConfigError(
                f'{self._path} has {len(self.topics)} topics, more than {MOST_TOPICS}'
            )
        reasons = [f'{name}: {why}' for name, why in self.left_out.items()]
        if reasons and not self.topics:
            raise ConfigError(f'{self._path}: no message can be read from it: {reasons[0]}')
        self.remarks += [
            f'{name} is left out: {why}'
            for name, why in list(self.left_out.items())[:_MOST_REMARKS]
        ]
        if len(reasons) > _MOST_REMARKS:
            self.remarks.append(f'{len(reasons) - _MOST_REMARKS} more channels are left out')

    def _remark_on_files(self, any_message: bool) -> None:
        self.remarks += [
            f'{path} was not closed: it is read up to its last whole message'
            for path in self.unfinished
        ]
        if not any_message:
            self.remarks.append(f'{self._path} holds no message')

    def _unpack_folder(self) -> Path:
        if self._unpacked_in is None:
            self._unpacked_in = new_folder()
            weakref.finalize(self, shutil.rmtree, self._unpacked_in, ignore_errors=True)
        return self._unpacked_in


def print_remarks(recording: Recording) -> None:
    """Print, on stderr, what a user should know of a recording."""
    for remark in recording.remarks:
        print(remark, file=sys.stderr)


def _warn_of_damage(file: _OpenedFile) -> None:
    damaged = dict(file.storage.damaged)  # the same part may have been met twice
    if damaged:
        where, why = next(iter(damaged.items()))
        print(
            f'{file.path}: {len(damaged)} damaged parts were left out; at {where}: {why}',
            file=sys.stderr,
        )
    if file.storage.finished and file.storage.cut_short:
        print(
            f'{file.path}: only its beginning can be read: {file.storage.cut_short}',
            file=sys.stderr,
        )


def _label(number: int, topic: str) -> str:
    if not topic:
        return f'channel {number}'
    return topic if _TOPIC.fullmatch(topic) else repr(topic[:100])


def _why_unreadable(number: int, channel: StoredChannel, type_name: str) -> str:
    """Return why no message of a channel can be used as one of ROS 2; '' if it can."""
    if not channel.topic and not channel.encoding:
        return f'the file has messages of channel {number}, but does not describe it'
    if channel.encoding == 'ros1':
        return (
            'its messages are of ROS 1 (encoding ros1), not CDR: convert the .bag that they come '
            'from with rosbags-convert (docs/recording.md)'
        )
    if channel.encoding != 'cdr':
        return f'its messages have the encoding {channel.encoding[:50]!r}, not ROS 2 (cdr)'
    if not _TOPIC.fullmatch(channel.topic):
        return f'{channel.topic[:100]!r} is no name of a topic'
    if not type_name:
        return 'neither the file (no schema) nor metadata.yaml names the type of its messages'
    return ''
