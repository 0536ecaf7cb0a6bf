"""Write a folder of MCAP files that is flushed, split, and bounded in size and age."""

import os
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import yaml
from mcap.writer import CompressionType, Writer

from ja_common.core.config import ConfigError
from ja_common.core.safe_files import parse_yaml
from ja_common.message_types import schema_of
from ja_common.ros_defaults import ros_distro

_MB = 10**6
_CHUNK_BYTES = 1 << 20


@dataclass(frozen=True)
class Channel:
    """What a recording keeps of a topic; `offered_qos` is rosbag2's YAML."""

    topic: str
    type_name: str
    offered_qos: str = ''
    type_hash: str = ''


@dataclass(frozen=True)
class Limits:
    """When to begin a new file, and when to delete the oldest ones; 0: never."""

    split_mb: float = 256.0
    split_s: float = 600.0
    keep_mb: float = 0.0
    keep_s: float = 0.0


@dataclass
class _OpenFile:
    """One file of the folder, with what metadata.yaml needs to know of it."""

    path: Path
    began_s: float
    first_ns: int = 2**63 - 1
    last_ns: int = 0
    counts: dict[str, int] = field(default_factory=dict)

    def count_message(self, topic: str, stamp_ns: int) -> None:
        self.first_ns = min(self.first_ns, stamp_ns)
        self.last_ns = max(self.last_ns, stamp_ns)
        self.counts[topic] = self.counts.get(topic, 0) + 1

    def metadata_entry(self) -> dict[str, Any]:
        count = sum(self.counts.values())
        return {
            'path': self.path.name,
            'starting_time': {'nanoseconds_since_epoch': self.first_ns if count else 0},
            'duration': {'nanoseconds': self.last_ns - self.first_ns if count else 0},
            'message_count': count,
        }


class RecordingFolder:
    """A writer of messages in the order of its calls; not thread-safe.

    What `flush` has written survives a crash of this process. `close` adds the indexes, and the
    metadata.yaml of rosbag2; a file without them can be read up to its last whole message.
    `custom_data`: further texts for metadata.yaml. Raises OSError when the disk is full or fails.
    """

    def __init__(self, folder: Path, limits: Limits) -> None:
        self._folder = folder
        self._limits = limits
        self._files: list[_OpenFile] = []
        self._channels: dict[str, Channel] = {}
        self.custom_data: dict[str, str] = {}
        self._number = 0
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.glob('*.mcap')):
            raise ConfigError(f'{folder} holds a recording already: name another folder')
        self._open_file()

    def write_message(
        self, channel: Channel, data: bytes, stamp_ns: int, sent_ns: int, sequence: int
    ) -> None:
        """Write one message, as it was on the wire (CDR). Times: wall clock [ns]."""
        self._channels[channel.topic] = channel
        if channel.topic not in self._ids:
            self._ids[channel.topic] = self._register_channel(channel)
        self._writer.add_message(
            self._ids[channel.topic], stamp_ns, data, sent_ns, sequence % 2**32
        )
        self._files[-1].count_message(channel.topic, stamp_ns)

    def flush(self) -> None:
        """Flush to the operating system; split the recording and delete old files when due."""
        self._writer.flush()
        file = self._files[-1]
        age_s = time.monotonic() - file.began_s
        size = os.fstat(self._stream.fileno()).st_size
        full = 0 < self._limits.split_mb * _MB <= size
        if file.counts and (full or 0 < self._limits.split_s <= age_s):
            self._finish_file()
            self._open_file()
        self._delete_oldest()

    def close(self) -> None:
        """Finish the file and write metadata.yaml."""
        self._finish_file()
        if self._channels:
            text = yaml.safe_dump(self._description(), sort_keys=False)
            (self._folder / 'metadata.yaml').write_text(text, encoding='utf-8')

    def _open_file(self) -> None:
        path = self._folder / f'{self._folder.name}_{self._number}.mcap'
        self._number += 1
        self._files.append(_OpenFile(path, time.monotonic()))
        self._stream: IO[bytes] = path.open('wb')
        self._writer = Writer(
            self._stream, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD
        )
        self._writer.start(profile='ros2', library='joint-attention')
        self._schemas: dict[str, int] = {}
        self._ids: dict[str, int] = {}

    def _finish_file(self) -> None:
        try:
            self._writer.finish()
        finally:
            self._stream.close()

    def _register_channel(self, channel: Channel) -> int:
        if channel.type_name not in self._schemas:
            text = schema_of(channel.type_name).encode()
            self._schemas[channel.type_name] = self._writer.register_schema(
                channel.type_name, 'ros2msg', text
            )
        return self._writer.register_channel(
            channel.topic,
            'cdr',
            self._schemas[channel.type_name],
            {'offered_qos_profiles': channel.offered_qos, 'topic_type_hash': channel.type_hash},
        )

    def _delete_oldest(self) -> None:
        """Delete files beyond the limits, but never the one that is being written."""
        while len(self._files) > 1 and self._exceeds_limits():
            self._files.pop(0).path.unlink(missing_ok=True)

    def _exceeds_limits(self) -> bool:
        size = sum(file.path.stat().st_size for file in self._files if file.path.exists())
        # A file is as old as the message that ended it.
        age_s = time.monotonic() - self._files[1].began_s
        return 0 < self._limits.keep_mb * _MB < size or 0 < self._limits.keep_s < age_s

    def _description(self) -> dict[str, Any]:
        files = [file for file in self._files if file.counts]
        first_ns = min((file.first_ns for file in files), default=0)
        last_ns = max((file.last_ns for file in files), default=0)
        counts = {
            topic: sum(file.counts.get(topic, 0) for file in files) for topic in self._channels
        }
        return {
            'rosbag2_bagfile_information': {
                'version': 9,
                'storage_identifier': 'mcap',
                'duration': {'nanoseconds': last_ns - first_ns},
                'starting_time': {'nanoseconds_since_epoch': first_ns},
                'message_count': sum(counts.values()),
                'topics_with_message_count': [
                    {
                        'topic_metadata': {
                            'name': channel.topic,
                            'type': channel.type_name,
                            'serialization_format': 'cdr',
                            'offered_qos_profiles': _profiles(channel),
                            'type_description_hash': channel.type_hash,
                        },
                        'message_count': counts[channel.topic],
                    }
                    for channel in self._channels.values()
                ],
                'compression_format': '',
                'compression_mode': '',
                'relative_file_paths': [file.path.name for file in files],
                'files': [file.metadata_entry() for file in files],
                'custom_data': dict(self.custom_data) or None,
                'ros_distro': ros_distro(),
            }
        }


def _profiles(channel: Channel) -> list[Any]:
    return parse_yaml(channel.offered_qos, channel.topic) or []
