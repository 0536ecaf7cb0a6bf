"""Recordings of other programs: what can be read is read, the rest is named with what to do."""

import shlex
import subprocess
import sys
from itertools import product
from pathlib import Path

import pytest
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Footer, Schema
from mcap.writer import CompressionType, IndexType
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.typesys import Stores, get_typestore

from foreign_bags import FLOAT, RATES, write_db3, write_mcap, write_metadata
from ja_common.core.config import ConfigError
from ja_recording.core.reader import Recording

MAGIC = b'\x89MCAP0\r\n'
GOOD = ('/rate', FLOAT, 'cdr')


def read(path: Path) -> list[bytes]:
    return [message.data for message in Recording(path).messages()]


@pytest.mark.parametrize(
    ('channel', 'why'),
    [
        (('/a', 'pkg.Message', 'protobuf'), "encoding 'protobuf'"),
        (('/a', '', 'json'), "encoding 'json'"),
        (('/a', FLOAT, ''), "encoding ''"),
        (('/a', 'std_msgs/Float32', 'ros1'), 'rosbags-convert'),
        (('/a', '', 'cdr'), 'no schema'),
        (('camera one', FLOAT, 'cdr'), 'no name of a topic'),
        (('/rate', 'std_msgs/msg/String', 'cdr'), 'second type'),
    ],
    ids=lambda value: str(value)[:30],
)
def test_a_channel_that_cannot_be_read_blocks_no_other(channel, why, tmp_path):
    recording = Recording(write_mcap(tmp_path / 'x.mcap', [GOOD, channel]))
    assert [message.data for message in recording.messages()] == RATES
    [remark] = recording.remarks
    assert why in remark
    assert channel[0] in remark
    assert '\n' not in remark


def test_a_recording_of_such_channels_alone_is_refused_with_the_cause(tmp_path):
    path = write_mcap(tmp_path / 'x.mcap', [('/a', 'std_msgs/String', 'ros1')])
    with pytest.raises(ConfigError, match=r'no message can be read from it: /a: .*ROS 1'):
        Recording(path)


def test_what_is_left_out_is_not_looked_at(tmp_path):
    path = write_mcap(tmp_path / 'x.mcap', [GOOD, ('/a', '', 'json')])
    recording = Recording(path, ['a'])
    assert recording.remarks == []
    assert set(recording.topics) == {'/rate'}
    with pytest.raises(ConfigError, match='no topic /b in the recording; it holds: /rate'):
        Recording(path, ['b'])


def test_a_type_in_the_words_of_ros1_is_understood(tmp_path):
    recording = Recording(write_mcap(tmp_path / 'x.mcap', [('/rate', 'std_msgs/Float32', 'cdr')]))
    assert recording.topics['/rate'].type_name == FLOAT


def test_the_type_of_a_channel_without_a_schema_comes_from_the_metadata(tmp_path):
    write_mcap(tmp_path / 'x_0.mcap', [('/rate', '', 'cdr')])
    write_metadata(tmp_path, 'x_0.mcap', storage='mcap')
    for path in (tmp_path, tmp_path / 'x_0.mcap'):
        assert Recording(path).topics['/rate'].type_name == FLOAT


SWITCHES = ('repeat_channels', 'repeat_schemas', 'use_statistics', 'use_summary_offsets')
INDICES = (IndexType.ALL, IndexType.NONE, IndexType.CHUNK, IndexType.MESSAGE)


@pytest.mark.parametrize('chunked', [True, False])
@pytest.mark.parametrize('index', INDICES)
def test_each_optional_record_may_lack(chunked, index, tmp_path):
    for values in product([True, False], repeat=len(SWITCHES)):
        options = dict(zip(SWITCHES, values, strict=True))
        path = write_mcap(tmp_path / 'x.mcap', index_types=index, use_chunking=chunked, **options)
        recording = Recording(path)
        assert [message.data for message in recording.messages()] == RATES, options
        assert recording.remarks == []
        assert (recording.first_ns, recording.last_ns) == (1, 6)


def packed(*contents: object) -> bytes:
    builder = RecordBuilder()
    for content in contents:
        content.write(builder)
    return builder.end()


def test_a_finished_file_without_any_summary_is_a_finished_file(tmp_path):
    path = write_mcap(tmp_path / 'x.mcap')
    whole = path.read_bytes()
    start = int.from_bytes(whole[-28:-20], 'little')
    end = packed(Footer(summary_start=0, summary_offset_start=0, summary_crc=0))
    path.write_bytes(whole[:start] + end + MAGIC)
    recording = Recording(path)
    assert [message.data for message in recording.messages()] == RATES
    assert recording.remarks == []


def test_messages_beside_an_indexed_chunk_are_read(tmp_path):
    path = write_mcap(tmp_path / 'x.mcap')
    whole = path.read_bytes()
    # Before the end of the data; what the index says of the chunks stays true.
    end = whole.index(bytes([Opcode.DATA_END]) + (4).to_bytes(8, 'little'))
    start = int.from_bytes(whole[-28:-20], 'little')
    extra = message(1, 9, RATES[0])
    footer = packed(
        Footer(summary_start=start + len(extra), summary_offset_start=0, summary_crc=0)
    )
    path.write_bytes(whole[:end] + extra + whole[end : -28 - 9] + footer + MAGIC)
    assert read(path) == [*RATES, RATES[0]]


def message(channel: int, stamp_ns: int, data: bytes) -> bytes:
    content = channel.to_bytes(2, 'little') + bytes(4) + stamp_ns.to_bytes(8, 'little') * 2 + data
    return bytes([Opcode.MESSAGE]) + len(content).to_bytes(8, 'little') + content


def test_messages_of_a_channel_that_is_not_described_are_named(tmp_path):
    path = tmp_path / 'x.mcap'
    described = packed(
        Schema(id=1, name=FLOAT, encoding='ros2msg', data=b''),
        Channel(id=1, schema_id=1, topic='/rate', message_encoding='cdr', metadata={}),
    )
    path.write_bytes(MAGIC + described + message(1, 3, RATES[1]) + message(7, 3, RATES[2]))
    recording = Recording(path)
    assert [message.data for message in recording.messages()] == [RATES[1]]
    assert 'channel 7' in recording.remarks[0]


def test_a_channel_whose_schema_lacks_is_left_out(tmp_path):
    path = tmp_path / 'x.mcap'
    channel = Channel(id=1, schema_id=5, topic='/a', message_encoding='cdr', metadata={})
    path.write_bytes(MAGIC + packed(channel) + message(1, 3, RATES[0]))
    with pytest.raises(ConfigError, match='no schema'):
        Recording(path)


def test_split_files_are_read_in_the_order_of_time(tmp_path):
    write_mcap(tmp_path / 'x_0.mcap', stamps_ns=(1, 3, 5))
    write_mcap(tmp_path / 'x_1.mcap', stamps_ns=(2, 4, 9))
    write_mcap(tmp_path / 'x_10.mcap', stamps_ns=(20,))
    write_mcap(tmp_path / 'x_2.mcap', stamps_ns=(10, 11))
    (tmp_path / '._x_0.mcap').write_bytes(b'Mac OS X')
    stamps = [message.stamp_ns for message in Recording(tmp_path).messages()]
    assert stamps == [1, 2, 3, 4, 5, 9, 10, 11, 20]


@pytest.mark.parametrize('given', ['', 'metadata.yaml', 'x_0.db3'])
def test_a_recording_is_given_as_folder_file_or_metadata(given, tmp_path):
    write_db3(tmp_path / 'x_0.db3')
    write_metadata(tmp_path, 'x_0.db3')
    assert read(tmp_path / given) == RATES
    assert Recording(tmp_path / given).remarks == []


def test_a_metadata_that_is_wrong_costs_no_message(tmp_path):
    write_db3(tmp_path / 'x_0.db3')
    for text, why in (
        ('a: [', 'not YAML'),
        ('a: 1', 'no metadata of rosbag2'),
        ('rosbag2_bagfile_information: [1]', 'no metadata of rosbag2'),
        ('- 1', 'no metadata of rosbag2'),
    ):
        (tmp_path / 'metadata.yaml').write_text(text)
        recording = Recording(tmp_path)
        assert [message.data for message in recording.messages()] == RATES
        assert why in recording.remarks[0]


def test_a_file_that_the_metadata_names_but_is_not_there_is_named(tmp_path):
    write_db3(tmp_path / 'renamed_0.db3')
    write_metadata(tmp_path, 'x/x_0.db3', '../../secret.db3', 'renamed_0.db3')
    recording = Recording(tmp_path)
    assert [message.data for message in recording.messages()] == RATES
    assert ['x_0.db3 is not there' in recording.remarks[0], len(recording.remarks)] == [True, 2]
    assert str(tmp_path / 'secret.db3') in recording.remarks[1]


def test_a_conversion_in_the_same_folder_is_not_read_twice(tmp_path):
    write_db3(tmp_path / 'x_0.db3')
    write_mcap(tmp_path / 'x_0.mcap')
    with pytest.raises(ConfigError, match=r'several formats: name one of x_0\.db3, x_0\.mcap'):
        Recording(tmp_path)
    write_metadata(tmp_path, 'x_0.db3')
    recording = Recording(tmp_path)
    assert [message.data for message in recording.messages()] == RATES
    assert 'x_0.mcap is not read' in recording.remarks[0]


def test_a_folder_of_recordings_names_them(tmp_path):
    (tmp_path / 'monday').mkdir()
    write_db3(tmp_path / 'monday' / 'x_0.db3')
    with pytest.raises(ConfigError, match='name one of monday'):
        Recording(tmp_path)


@pytest.mark.parametrize(
    ('head', 'why'),
    [
        (b'', 'empty'),
        (b'PK\x03\x04..', 'zip'),
        (b'\xfd7zXZ\0..', 'xz'),
        (b'version https://git-lfs.github.com/spec/v1\n', 'git lfs pull'),
        (b'<!DOCTYPE html><html>', 'web page'),
        (b'something', 'neither MCAP nor SQLite'),
    ],
)
def test_a_file_that_is_something_else_is_refused_by_its_content(head, why, tmp_path):
    path = tmp_path / 'x.mcap'
    path.write_bytes(head)
    with pytest.raises(ConfigError, match=why) as refused:
        Recording(path)
    assert '\n' not in str(refused.value)


def test_another_storage_is_refused_with_the_conversion(tmp_path):
    write_metadata(tmp_path, 'x_0.zarr', storage='zarr')
    with pytest.raises(ConfigError, match=r'ros2 bag convert -i .* -o out\.yaml'):
        Recording(tmp_path)


def test_a_recording_without_messages_is_named(tmp_path):
    recording = Recording(write_mcap(tmp_path / 'x.mcap', stamps_ns=()))
    assert list(recording.messages()) == []
    assert recording.remarks == [f'{tmp_path / "x.mcap"} holds no message']


def test_the_conversion_that_is_named_for_ros1_works(tmp_path):
    store = get_typestore(Stores.ROS1_NOETIC)
    value = store.types[FLOAT](data=0.5)
    path = tmp_path / 'my bag.bag'
    with Rosbag1Writer(path) as writer:
        connection = writer.add_connection('/rate', FLOAT, typestore=store)
        writer.write(connection, 5, store.serialize_ros1(value, FLOAT))
    for given in (path, tmp_path):
        with pytest.raises(ConfigError, match='recording of ROS 1') as refused:
            Recording(given)
    command = str(refused.value).split('`')[3]
    program, *arguments = shlex.split(command)
    assert program == 'rosbags-convert'
    subprocess.run([sys.executable, '-m', 'rosbags.convert', *arguments], check=True)
    recording = Recording(tmp_path / 'my bag')
    assert [message.stamp_ns for message in recording.messages()] == [5]
    assert recording.topics['/rate'].type_name == FLOAT


def test_compressed_chunks_of_another_writer_are_read(tmp_path):
    for compression in (CompressionType.ZSTD, CompressionType.LZ4):
        assert read(write_mcap(tmp_path / 'x.mcap', compression=compression)) == RATES
