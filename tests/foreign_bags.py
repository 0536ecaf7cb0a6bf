"""Recordings as other programs write them, for tests: MCAP by parts, SQLite, ROS 1."""

import sqlite3
from collections.abc import Iterable, Sequence
from contextlib import closing
from pathlib import Path

from mcap.writer import CompressionType, Writer
from rclpy.serialization import serialize_message
from std_msgs.msg import Float32

FLOAT = 'std_msgs/msg/Float32'
RATES = [serialize_message(Float32(data=float(n))) for n in range(6)]


def write_mcap(
    path: Path,
    channels: Sequence[tuple[str, str, str]] = (('/rate', FLOAT, 'cdr'),),
    stamps_ns: Iterable[int] = range(1, 7),
    data: Sequence[bytes] = RATES,
    **options: object,
) -> Path:
    """Write messages on each of these channels: (topic, type or '' for no schema, encoding)."""
    options = {'compression': CompressionType.NONE, 'chunk_size': 60, **options}
    with path.open('wb') as stream:
        writer = Writer(stream, **options)
        writer.start(profile='', library='another')
        numbers = []
        for topic, kind, encoding in channels:
            schema = writer.register_schema(kind, 'ros2msg', b'') if kind else 0
            numbers.append(writer.register_channel(topic, encoding, schema))
        for stamp_ns, each in zip(stamps_ns, data, strict=False):
            for number in numbers:
                writer.add_message(number, stamp_ns, each, stamp_ns)
        writer.finish()
    return path


TABLES = {
    1: 'CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, '
    'serialization_format TEXT NOT NULL)',
    2: 'CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, '
    'serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)',
    4: 'CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, '
    'serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL, '
    'type_description_hash TEXT NOT NULL)',
}
MESSAGES = (
    'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, '
    'timestamp INTEGER NOT NULL, data BLOB NOT NULL)'
)
INDEX = 'CREATE INDEX timestamp_idx ON messages (timestamp ASC)'


def write_db3(
    path: Path,
    topics: Sequence[tuple[str, str, str]] = (('/rate', FLOAT, 'cdr'),),
    rows: Iterable[tuple[int, int, bytes]] = tuple((1, n + 1, d) for n, d in enumerate(RATES)),
    version: int = 4,
    indexed: bool = True,
) -> Path:
    """Write rows (number of the topic from 1, stamp [ns], data) as rosbag2's SQLite storage."""
    with closing(sqlite3.connect(path)) as database:
        database.execute(TABLES[version])
        database.execute(MESSAGES)
        if indexed:
            database.execute(INDEX)
        more = {1: (), 2: ('',), 4: ('', '')}[version]
        for number, topic in enumerate(topics, 1):
            values = (number, *topic, *more)
            places = ', '.join('?' * len(values))
            database.execute(f'INSERT INTO topics VALUES ({places})', values)
        database.executemany(
            'INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)', rows
        )
        database.commit()
    return path


METADATA = """rosbag2_bagfile_information:
  version: 99
  storage_identifier: {storage}
  a_key_of_another_year: {{deep: [1, 2]}}
  duration: {{nanoseconds: 5}}
  relative_file_paths: [{files}]
  topics_with_message_count:
    - topic_metadata: {{name: /rate, type: std_msgs/msg/Float32, serialization_format: cdr}}
      message_count: 6
"""


def write_metadata(folder: Path, *files: str, storage: str = 'sqlite3') -> Path:
    path = folder / 'metadata.yaml'
    path.write_text(METADATA.format(files=', '.join(files), storage=storage))
    return path
