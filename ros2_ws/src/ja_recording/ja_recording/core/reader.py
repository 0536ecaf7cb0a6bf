"""Read recordings: MCAP files of any ROS 2 recorder, unfinished and damaged files included."""

import re
import sys
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Channel

from ja_common.core.config import ConfigError
from ja_recording.core.mcap_file import LATEST_NS, MOST_TOPICS, McapFile, read_mcap
from ja_recording.core.mcap_records import DamagedError

_TOPIC = re.compile(r'(/[A-Za-z_][A-Za-z0-9_]*)+')


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
        paths = sorted(path.glob('*.mcap'), key=_order_in_folder) if path.is_dir() else [path]
        if not paths or not all(each.is_file() for each in paths):
            raise ConfigError(f'{path}: no recording (.mcap) there')
        self._files = [_read_file(each) for each in paths]
        self.unfinished = [file.path for file in self._files if not file.finished]
        self._topics_of = {file.path: _topics(file) for file in self._files}
        self.topics = {
            topic.name: topic for topics in self._topics_of.values() for topic in topics.values()
        }
        if len(self.topics) > MOST_TOPICS:
            raise ConfigError(f'{path} has {len(self.topics)} topics, more than {MOST_TOPICS}')
        parts = [part for file in self._files for part in file.parts.values()]
        stamps = [min(part.first_ns, LATEST_NS) for part in parts]
        self.first_ns = min(stamps, default=0)
        self.last_ns = max([min(part.last_ns, LATEST_NS) for part in parts], default=0)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[RecordedMessage]:
        """Yield the messages of some topics (None: all) in the order of publication.

        Damaged parts are left out, and named on stderr at the end. Raises ConfigError when a file
        cannot be read.
        """
        for file in self._files:
            topic_of = {
                number: topic
                for number, topic in self._topics_of[file.path].items()
                if topics is None or topic.name in topics
            }
            try:
                for message in file.messages(topic_of.keys()):
                    topic = topic_of[message.channel_id]
                    yield RecordedMessage(topic, message.log_time, message.data)
            except (DamagedError, OSError) as error:
                raise ConfigError(f'{file.path} cannot be read: {error}') from None
            _warn_of_damage(file)


def warn_of_unfinished(recording: Recording) -> None:
    """Print, on stderr, which files their recorder did not close."""
    for path in recording.unfinished:
        print(f'{path} was not closed: it is read up to its last whole message', file=sys.stderr)


def _read_file(path: Path) -> McapFile:
    try:
        file = read_mcap(path)
    except (DamagedError, OSError) as error:
        raise ConfigError(f'{path} cannot be read: {error}') from None
    why = [*([file.cut_short] if file.cut_short else []), *(why for _, why in file.damaged)]
    if why and not file.parts:
        raise ConfigError(f'{path}: no message can be read from it: {why[0]}')
    return file


def _warn_of_damage(file: McapFile) -> None:
    damaged = dict(file.damaged)  # the same part may have been met twice
    if damaged:
        offset, why = next(iter(damaged.items()))
        print(
            f'{file.path}: {len(damaged)} damaged parts were left out; at byte {offset}: {why}',
            file=sys.stderr,
        )
    if file.finished and file.cut_short:
        print(f'{file.path}: only its beginning can be read: {file.cut_short}', file=sys.stderr)


def _topics(file: McapFile) -> dict[int, RecordedTopic]:
    """Return the topics by the numbers of their channels."""
    return {number: _topic(file, channel) for number, channel in file.channels.items()}


def _topic(file: McapFile, channel: Channel) -> RecordedTopic:
    if not _TOPIC.fullmatch(channel.topic):
        raise ConfigError(f'{file.path}: {channel.topic[:100]!r} is no name of a topic')
    type_name = file.schemas.get(channel.schema_id)
    if type_name is None or channel.message_encoding != 'cdr':
        raise ConfigError(f'{file.path}: {channel.topic} is not recorded as a ROS 2 message (CDR)')
    offered = channel.metadata.get('offered_qos_profiles', '')
    return RecordedTopic(channel.topic, type_name, offered)


def _order_in_folder(path: Path) -> tuple[int, str]:
    last = path.stem.rpartition('_')[2]
    return (int(last) if last.isdecimal() else 0, path.name)
