"""Whatever an MCAP file holds: what is whole is read, the rest is refused in one sentence."""

import io
import resource
import struct
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Schema
from mcap.writer import CompressionType, Writer
from rclpy.serialization import serialize_message
from std_msgs.msg import Float32

from ja_common.core.config import ConfigError
from ja_recording.core import mcap_file, mcap_records
from ja_recording.core.reader import Recording

MAGIC = b'\x89MCAP0\r\n'
RATES = [serialize_message(Float32(data=float(n))) for n in range(12)]
COMPRESSIONS = [CompressionType.NONE, CompressionType.ZSTD, CompressionType.LZ4]


def small_recording(compression: CompressionType, **options: object) -> bytes:
    """Return a finished file of twelve numbers in four chunks."""
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=90, compression=compression, **options)
    writer.start(profile='ros2', library='test')
    schema = writer.register_schema('std_msgs/msg/Float32', 'ros2msg', b'float32 data')
    channel = writer.register_channel('/rate', 'cdr', schema)
    for number, data in enumerate(RATES):
        writer.add_message(channel, number + 1, data, number + 1, number)
    writer.finish()
    return stream.getvalue()


def read(path: Path) -> list[bytes]:
    return [message.data for message in Recording(path).messages()]


def read_what_is_whole(path: Path) -> list[bytes]:
    """Return the messages, or none where the file is refused, which must be in one sentence."""
    try:
        return read(path)
    except ConfigError as error:
        [sentence] = str(error).splitlines()
        if not sentence.startswith(str(path)):
            raise
        return []


def file_of(folder: Path, *records: bytes) -> Path:
    """Write a file without a summary, as a recorder leaves it that was killed."""
    path = folder / 'x.mcap'
    path.write_bytes(MAGIC + b''.join(records))
    return path


def record(opcode: int, content: bytes = b'', length: int | None = None) -> bytes:
    return struct.pack('<BQ', opcode, len(content) if length is None else length) + content


def packed(*contents: object) -> bytes:
    builder = RecordBuilder()
    for content in contents:
        content.write(builder)
    return builder.end()


RATE = packed(
    Schema(id=1, name='std_msgs/msg/Float32', encoding='ros2msg', data=b''),
    Channel(id=1, schema_id=1, topic='/rate', message_encoding='cdr', metadata={}),
)


def message(stamp_ns: int, data: bytes) -> bytes:
    return record(Opcode.MESSAGE, struct.pack('<HIQQ', 1, 0, stamp_ns, stamp_ns) + data)


def chunk(compression: str, data: bytes, size: int, stamp_ns: int = 1, crc: int = 0) -> bytes:
    return packed(
        Chunk(
            compression=compression, data=data, uncompressed_size=size, uncompressed_crc=crc,
            message_start_time=stamp_ns, message_end_time=stamp_ns,
        )
    )  # fmt: skip


@pytest.fixture
def memory_limit():
    """Limit the memory that can be asked for to 2 GB beyond what is in use."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path('/proc/self/statm').read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 2 * 10**9, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.parametrize('compression', COMPRESSIONS)
@pytest.mark.parametrize(
    'options',
    [
        {},
        {'use_chunking': False},
        {'use_statistics': False},
        {'repeat_channels': False},
        {'use_summary_offsets': False},
    ],
)
def test_every_kind_of_finished_file_is_read(compression, options, tmp_path):
    (tmp_path / 'x.mcap').write_bytes(small_recording(compression, **options))
    assert read(tmp_path / 'x.mcap') == RATES
    assert Recording(tmp_path / 'x.mcap').unfinished == []


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_a_flipped_byte_never_changes_a_message(compression, tmp_path, capsys):
    """A damaged chunk is left out as a whole; damage elsewhere costs no message."""
    whole = small_recording(compression)
    path = tmp_path / 'x.mcap'
    most = 0
    for position in range(0, len(whole), 3):
        damaged = bytearray(whole)
        damaged[position] ^= 0xFF
        path.write_bytes(damaged)
        found = read_what_is_whole(path)
        assert [each for each in RATES if each in found] == found
        most += len(found)
    assert most > 0.5 * len(RATES) * len(range(0, len(whole), 3))
    assert 'damaged parts were left out; at byte' in capsys.readouterr().err


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_a_file_is_read_up_to_where_it_was_cut(compression, tmp_path):
    whole = small_recording(compression)
    path = tmp_path / 'x.mcap'
    counts = []
    for length in range(0, len(whole), 7):
        path.write_bytes(whole[:length])
        found = read_what_is_whole(path)
        assert found == RATES[: len(found)]
        counts.append(len(found))
    assert counts == sorted(counts)
    assert counts[-1] == len(RATES)


BIG = mcap_records.LARGEST_BYTES + 2**20
MANY = message(1, b'') * (mcap_records.MOST_MESSAGES + 1)


def zstd_without_a_size() -> bytes:
    stream = zstandard.ZstdCompressor(level=1).compressobj()
    return b''.join(stream.compress(bytes(2**26)) for _ in range(5)) + stream.flush()


BOMBS = {
    'zstd that names its size': lambda: chunk('zstd', zstandard.compress(bytes(BIG)), BIG),
    'zstd that names another size': lambda: chunk('zstd', zstandard.compress(bytes(BIG)), 100),
    'zstd that names no size': lambda: chunk('zstd', zstd_without_a_size(), 100),
    'zstd of no size': lambda: chunk('zstd', zstd_without_a_size(), 0),
    'lz4 of the right size': lambda: chunk('lz4', lz4.frame.compress(bytes(BIG)), BIG),
    'lz4 of another size': lambda: chunk('lz4', lz4.frame.compress(bytes(BIG)), 100),
    'an enormous size': lambda: chunk('zstd', zstandard.compress(b'x'), 2**63),
    'many tiny messages': lambda: chunk('zstd', zstandard.compress(MANY), len(MANY)),
    'a message of an enormous length': lambda: record(Opcode.MESSAGE, b'', 2**62),
    'a chunk of an enormous length': lambda: record(Opcode.CHUNK, b'', 2**62),
    'a chunk within of an enormous length': lambda: record(
        Opcode.CHUNK, struct.pack('<QQQIIQ', 1, 1, 10, 0, 0, 2**62)
    ),
    'a name of an enormous length': lambda: record(
        Opcode.SCHEMA, struct.pack('<HI', 1, 2**32 - 1)
    ),
    'a long schema': lambda: record(Opcode.SCHEMA, bytes(2**20 + 1)),
    'a long channel': lambda: record(Opcode.CHANNEL, bytes(2**16 + 1)),
    'an unknown compression': lambda: chunk('bz2', b'x', 10),
    'a record of an unknown kind': lambda: record(0x7F, b'', 2**63),
}


@pytest.mark.parametrize('make_bomb', BOMBS.values(), ids=BOMBS)
def test_what_would_fill_the_memory_is_refused_or_left_out(make_bomb, tmp_path, memory_limit):
    bomb = make_bomb()
    path = file_of(tmp_path, RATE, bomb)
    with pytest.raises(ConfigError, match='no message can be read from it') as refused:
        Recording(path)
    assert '\n' not in str(refused.value)
    # What came before it is read; behind a chunk, what comes after it as well.
    path = file_of(tmp_path, RATE, message(1, RATES[0]), bomb, message(2, RATES[1]))
    assert read(path)[:1] == RATES[:1]


def test_chunks_of_the_same_time_are_not_all_held_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr(mcap_file, 'MOST_HELD_BYTES', 10**6)
    data = message(5, bytes(400_000))
    chunks = [chunk('zstd', zstandard.compress(data), len(data), stamp_ns=5) for _ in range(4)]
    with pytest.raises(ConfigError, match='of the same time'):
        read(file_of(tmp_path, RATE, *chunks))


def test_messages_outside_of_chunks_are_read_in_order(tmp_path):
    path = file_of(tmp_path, RATE, message(3, b'c'), message(1, b'a'), message(2, b''))
    assert read(path) == [b'a', b'', b'c']


def test_a_time_that_ros_cannot_express_is_left_out(tmp_path):
    path = file_of(tmp_path, RATE, message(1, b'a'), message(2**64 - 1, b'b'))
    recording = Recording(path)
    assert [each.data for each in recording.messages()] == [b'a']
    assert recording.last_ns <= mcap_file.LATEST_NS


@pytest.mark.parametrize('topic', ['', 'rate', '/rate\n', '/a b', '/' + 'a/' * 3, '/1', '/rate\0'])
def test_a_name_that_is_no_topic_is_refused(topic, tmp_path):
    bad = packed(
        Schema(id=1, name='std_msgs/msg/Float32', encoding='ros2msg', data=b''),
        Channel(id=1, schema_id=1, topic=topic, message_encoding='cdr', metadata={}),
    )
    with pytest.raises(ConfigError, match='no name of a topic'):
        Recording(file_of(tmp_path, bad, message(1, b'')))


def test_more_topics_than_a_graph_has_are_refused(tmp_path):
    channels = [
        Channel(id=n, schema_id=1, topic=f'/t{n}', message_encoding='cdr', metadata={})
        for n in range(1, mcap_file.MOST_TOPICS + 2)
    ]
    with pytest.raises(ConfigError, match='more than 1000 topics'):
        Recording(file_of(tmp_path, RATE, packed(*channels), message(1, b'')))
