"""Written recordings can be read: by us, by other libraries, and after a crash."""

import time
from pathlib import Path

import pytest
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.highlevel import AnyReader
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Float32

from ja_common.core.config import ConfigError
from ja_common.message_types import message_class, schema_of
from ja_common.qos_text import profile_of
from ja_common.time_codec import to_time
from ja_common.topics import CLOCK, IMAGE, SUCCESS_RATE
from ja_recording.background_writer import BackgroundWriter, QueuedMessage
from ja_recording.core.reader import Recording
from ja_recording.recording_folder import Limits, RecordingFolder
from recordings import T0_NS, channel_of, write_recording

RATE = channel_of(SUCCESS_RATE)


def rates(*values: float):
    return [
        (i * 10**6, SUCCESS_RATE, Float32(data=float(value))) for i, value in enumerate(values)
    ]


def read_rates(path: Path) -> list[float]:
    messages = Recording(path).messages([RATE.topic])
    return [deserialize_message(m.data, Float32).data for m in messages]


def test_messages_come_back_unchanged_and_in_the_order_of_publication(tmp_path):
    messages = [
        (20, CLOCK, Clock(clock=to_time(5))),
        (10, SUCCESS_RATE, Float32(data=0.25)),
        (30, SUCCESS_RATE, Float32(data=0.5)),
    ]
    recording = Recording(write_recording(tmp_path / 'r', messages))
    found = [(m.stamp_ns - T0_NS, m.topic.name, m.data) for m in recording.messages()]
    assert found == [
        (stamp, channel_of(topic).topic, serialize_message(message))
        for stamp, topic, message in sorted(messages, key=lambda each: each[0])
    ]
    assert (recording.first_ns, recording.last_ns) == (T0_NS + 10, T0_NS + 30)
    assert not recording.unfinished


def test_a_schema_holds_every_type_within_it_once():
    text = schema_of('sensor_msgs/msg/CameraInfo')
    inner = [line[5:] for line in text.splitlines() if line.startswith('MSG: ')]
    assert sorted(inner) == [
        'builtin_interfaces/Time', 'sensor_msgs/RegionOfInterest', 'std_msgs/Header',
    ]  # fmt: skip
    assert message_class('sensor_msgs/msg/CameraInfo') is CameraInfo


def test_an_unknown_type_is_named():
    with pytest.raises(ConfigError, match='nothing_msgs/msg/None'):
        message_class('nothing_msgs/msg/None')
    with pytest.raises(ConfigError, match='nothing_msgs/msg/None'):
        schema_of('nothing_msgs/msg/None')


def test_the_offered_quality_of_service_is_kept(tmp_path):
    recording = Recording(write_recording(tmp_path / 'r', rates(1.0)))
    profile = profile_of(recording.topics[RATE.topic].offered_qos)
    assert profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
    assert profile.reliability is ReliabilityPolicy.RELIABLE
    assert profile_of(channel_of(IMAGE).offered_qos).durability is DurabilityPolicy.VOLATILE


def test_what_was_flushed_can_be_read_although_the_file_was_not_closed(tmp_path):
    folder = RecordingFolder(tmp_path / 'r', Limits())
    for stamp_ns, _, message in rates(1.0, 2.0, 3.0):
        folder.write_message(RATE, serialize_message(message), T0_NS + stamp_ns, 0, 0)
    folder.flush()
    [path] = (tmp_path / 'r').glob('*.mcap')
    assert read_rates(path) == [1.0, 2.0, 3.0]
    assert Recording(path).unfinished == [path]
    # Killed in the middle of the next chunk.
    size = path.stat().st_size
    folder.write_message(RATE, serialize_message(Float32(data=4.0)), T0_NS + 9, 0, 0)
    folder.flush()
    with path.open('r+b') as file:
        file.truncate(size + 20)
    assert read_rates(path) == [1.0, 2.0, 3.0]


def test_files_are_split_and_the_oldest_are_deleted(tmp_path):
    folder = RecordingFolder(tmp_path / 'r', Limits(split_mb=1e-6, keep_mb=0.004))
    for stamp_ns, _, message in rates(*range(20)):
        folder.write_message(RATE, serialize_message(message), T0_NS + stamp_ns, 0, 0)
        folder.flush()
    folder.close()
    found = read_rates(tmp_path / 'r')
    assert found == [float(value) for value in range(int(found[0]), 20)]
    assert 0 < found[0] < 20
    with AnyReader([tmp_path / 'r']) as reader:
        assert reader.message_count == len(found)


def test_files_are_deleted_when_they_are_too_old(tmp_path, monkeypatch):
    now_s = [100.0]
    monkeypatch.setattr(time, 'monotonic', lambda: now_s[0])
    folder = RecordingFolder(tmp_path / 'r', Limits(split_s=10.0, keep_s=25.0))
    for stamp_ns, _, message in rates(*range(10)):
        folder.write_message(RATE, serialize_message(message), T0_NS + stamp_ns, 0, 0)
        now_s[0] += 10.0
        folder.flush()
    folder.close()
    # The file of 0 s to 10 s is older than 25 s at 40 s.
    assert read_rates(tmp_path / 'r') == [7.0, 8.0, 9.0]


def test_messages_that_do_not_fit_the_queue_are_counted(tmp_path):
    writer = BackgroundWriter(RecordingFolder(tmp_path / 'r', Limits()), queue_bytes=100)
    writer.queue_message(QueuedMessage(RATE, bytes(101), T0_NS, T0_NS, 0))
    writer.queue_message(
        QueuedMessage(RATE, serialize_message(Float32(data=1.0)), T0_NS, T0_NS, 0)
    )
    writer.close()
    assert (writer.written, writer.dropped, writer.failure) == (1, 1, None)
    assert read_rates(tmp_path / 'r') == [1.0]


def test_a_failure_of_the_disk_is_reported_and_ends_the_writing(tmp_path):
    class FullDisk(RecordingFolder):
        def write_message(self, *_: object) -> None:
            raise OSError(28, 'No space left on device')

    writer = BackgroundWriter(FullDisk(tmp_path / 'r', Limits()), queue_bytes=10**6)
    writer.queue_message(QueuedMessage(RATE, b'', T0_NS, T0_NS, 0))
    writer.close()
    assert 'No space left' in (writer.failure or '')
    writer.queue_message(QueuedMessage(RATE, b'', T0_NS, T0_NS, 0))
    assert writer.dropped == 1


def test_a_recording_is_never_overwritten(tmp_path):
    write_recording(tmp_path / 'r', rates(1.0))
    with pytest.raises(ConfigError, match='holds a recording already'):
        RecordingFolder(tmp_path / 'r', Limits())


@pytest.mark.parametrize('content', [None, b'no recording at all'])
def test_a_file_that_is_no_recording_is_refused_by_name(content, tmp_path):
    path = tmp_path / 'x.mcap'
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError, match=r'x\.mcap'):
        Recording(path)
