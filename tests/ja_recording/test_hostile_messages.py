"""Recordings whose messages are not what their topics promise: one sentence each."""

import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import String

from ja_common.core.config import ConfigError
from ja_common.qos_text import profile_of
from ja_common.topics import DETECTIONS, FIXATION, JOINT_STATES
from ja_recording.core.reader import Recording
from ja_recording.recording_folder import Channel, Limits, RecordingFolder
from ja_recording.trials import recorded_trials
from recordings import T0_NS, channel_of


def recording_of(folder, *messages: tuple[Channel, bytes]) -> Recording:
    writer = RecordingFolder(folder, Limits())
    for number, (channel, data) in enumerate(messages):
        writer.write_message(channel, data, T0_NS + number, T0_NS + number, number)
    writer.close()
    return Recording(folder)


FIXATIONS, JOINTS, FOUND = map(channel_of, (FIXATION, JOINT_STATES, DETECTIONS))
STRING = serialize_message(String())
LONG = serialize_message(JointState(name=['pan'] * 50))


@pytest.mark.parametrize(
    ('channel', 'data', 'why'),
    [
        (Channel(JOINTS.topic, 'std_msgs/msg/String'), STRING, 'JointState is needed'),
        (Channel(FOUND.topic, 'std_msgs/msg/String'), STRING, 'PointCloud2 is needed'),
        (JOINTS, b'\x00\x01\x00\x00' + b'\xff' * 40, 'damaged'),
        (JOINTS, b'', 'damaged'),
        (JOINTS, LONG[:60], 'damaged'),
        (FOUND, serialize_message(PointCloud2(width=10**6, height=10**3)), 'lacks the fields'),
    ],
    # Not the bytes: those that fill a message up differ from process to process.
    ids=['joints are text', 'detections are text', 'noise', 'empty', 'cut off', 'no fields'],
)
def test_a_message_that_is_none_ends_the_reading_in_one_sentence(channel, data, why, tmp_path):
    good = {
        each.topic: (each, serialize_message(topic.type()))
        for each, topic in ((FIXATIONS, FIXATION), (JOINTS, JOINT_STATES), (FOUND, DETECTIONS))
    }
    messages = {**good, channel.topic: (channel, data)}
    # The bad message comes first.
    order = sorted(messages, key=lambda topic: topic != channel.topic)
    recording = recording_of(tmp_path / 'r', *(messages[topic] for topic in order))
    with pytest.raises(ConfigError, match=why) as refused:
        list(recorded_trials(recording))
    assert channel.topic in str(refused.value)
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize(
    'text',
    ['a', '5', '[1]', '{a: b}', '- history: 1', '- &a [*a]', '[' * 2000, '\0', '!!python/none',
     '- a: &x [1]\n  b: *x', '#' * 2**21],
)  # fmt: skip
def test_a_quality_of_service_that_is_none_is_refused(text):
    with pytest.raises(ConfigError) as refused:
        profile_of(text)
    assert '\n' not in str(refused.value)
    assert len(str(refused.value)) < 300
