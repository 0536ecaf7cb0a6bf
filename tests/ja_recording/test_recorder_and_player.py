"""A graph is recorded, and the recording is played back as a graph."""

import re
import signal
import subprocess
import sys

import pytest
from diagnostic_msgs.msg import KeyValue
from rclpy.serialization import deserialize_message
from rosbags.highlevel import AnyReader
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float32

from ja_common.core.config import ConfigError
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import (
    CLOCK,
    GATE_STATUS,
    IMAGE,
    IMAGE_ANNOTATED,
    SUCCESS_RATE,
    TARGET,
    TOPICS,
)
from ja_recording.core.reader import Recording
from ja_recording.player_node import PlayerNode
from ja_recording.recorder_node import RecorderNode
from recordings import T0_NS, write_recording
from ros_testing import PATIENCE_S

ALWAYS_PUBLISHED = '^/(rosout|parameter_events|diagnostics)$'


def test_every_topic_is_recorded_but_those_left_out(make_bench, tmp_path):
    bench = make_bench(RecorderNode, folder=str(tmp_path / 'r'), exclude='image_annotated|target')
    topics = (SUCCESS_RATE, IMAGE, IMAGE_ANNOTATED, TARGET)
    publishers = {t: bench.peer.create_publisher(t.type, t.name, t.publisher_qos) for t in topics}
    recorded = (publishers[SUCCESS_RATE], publishers[IMAGE])
    bench.wait(lambda: all(p.get_subscription_count() for p in recorded))
    for topic, publisher in publishers.items():
        publisher.publish(topic.type())
    publishers[SUCCESS_RATE].publish(Float32(data=0.75))

    bench.wait(lambda: bench.node.writer.written >= 3)
    bench.node.writer.close()
    recording = Recording(tmp_path / 'r')
    names = set(recording.topics)
    assert {'/sim/success_rate', '/image_raw'} <= names
    assert not {'/image_annotated', '/target'} & names


def test_another_library_decodes_every_type_of_the_graph(make_bench, tmp_path):
    """The schemas in the file suffice: this project writes, rosbags reads."""
    bench = make_bench(RecorderNode, folder=str(tmp_path / 'r'), exclude=ALWAYS_PUBLISHED)
    topics = [topic for topic in TOPICS if not re.match(ALWAYS_PUBLISHED, topic.name)]
    publishers = {t: bench.peer.create_publisher(t.type, t.name, t.publisher_qos) for t in topics}
    bench.wait(lambda: all(p.get_subscription_count() for p in publishers.values()))
    for topic, publisher in publishers.items():
        message = topic.type()
        if topic is GATE_STATUS:
            message.values = [KeyValue(key='phase', value='shift')]
        publisher.publish(message)
    bench.wait(lambda: bench.node.writer.written == len(topics))
    bench.node.writer.close()
    with AnyReader([tmp_path / 'r']) as reader:
        decoded = {c.topic: reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages()}
        counted = {c.topic: c.msgcount for c in reader.connections}
    assert {publisher.topic_name for publisher in publishers.values()} <= decoded.keys()
    assert counted.keys() == decoded.keys()
    assert decoded['/' + GATE_STATUS.name].values[0].value == 'shift'


def test_it_survives_kill_9_up_to_the_last_second(make_bench, tmp_path):
    folder = tmp_path / 'r'
    process = subprocess.Popen(
        [
            sys.executable, '-m', 'ja_recording.recorder_node',
            '--ros-args', '-p', f'folder:={folder}',
        ]
    )  # fmt: skip
    try:
        bench = make_bench(RecorderNode, folder=str(tmp_path / 'other'))
        publisher = bench.peer.create_publisher(Float32, 'x', 10)
        bench.wait(lambda: publisher.get_subscription_count() == 2)
        for value in range(50):
            publisher.publish(Float32(data=float(value)))
        # Flushed twice a second: a message that was published a second ago is there.
        bench.wait(lambda: len(rates_in(folder)) == 50)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait(timeout=PATIENCE_S)
    assert rates_in(folder) == [float(value) for value in range(50)]
    assert Recording(folder).unfinished
    bench.node.writer.close()


def rates_in(folder) -> list[float]:
    try:
        messages = list(Recording(folder).messages(['/x']))
    except ConfigError:
        return []  # nothing flushed yet
    return [deserialize_message(m.data, Float32).data for m in messages]


def rates(count: int, every_ns: int):
    return [(i * every_ns, SUCCESS_RATE, Float32(data=float(i))) for i in range(count)]


def test_a_recording_is_published_again_with_its_time(make_bench, tmp_path):
    path = write_recording(tmp_path / 'r', rates(5, 10**8))
    bench = make_bench(
        PlayerNode,
        subscribes=[SUCCESS_RATE, CLOCK],
        recording=str(path),
        speed=4.0,
        start_after_s=0.2,
    )
    bench.wait(lambda: bench.node.done and len(bench.messages(SUCCESS_RATE)) == 5)
    assert [message.data for message in bench.messages(SUCCESS_RATE)] == [0.0, 1.0, 2.0, 3.0, 4.0]
    clock = [to_ns(message.clock) for message in bench.messages(CLOCK)]
    assert clock == sorted(clock)
    assert clock[0] >= T0_NS
    assert clock[-1] <= T0_NS + 10**9


def test_the_recorded_clock_is_played(make_bench, tmp_path):
    messages = [*rates(2, 10**7), (2 * 10**7, CLOCK, Clock(clock=to_time(77)))]
    path = write_recording(tmp_path / 'r', messages)
    bench = make_bench(PlayerNode, subscribes=[CLOCK], recording=str(path), start_after_s=0.2)
    bench.wait(lambda: bench.node.done and bench.messages(CLOCK))
    assert [to_ns(message.clock) for message in bench.messages(CLOCK)] == [77]


def test_topics_are_left_out(make_bench, tmp_path):
    messages = [*rates(2, 10), (5, TARGET, TARGET.type())]
    path = write_recording(tmp_path / 'r', messages)
    bench = make_bench(
        PlayerNode, subscribes=[TARGET], recording=str(path), without='sim/success_rate',
        start_after_s=0.2,
    )  # fmt: skip
    bench.wait(lambda: bench.node.done and bench.messages(TARGET))
    assert bench.node.played == 1


def test_a_topic_that_is_not_there_cannot_be_left_out(make_bench, tmp_path):
    path = write_recording(tmp_path / 'r', rates(1, 1))
    with pytest.raises(ConfigError, match='no topic /other in the recording'):
        make_bench(PlayerNode, recording=str(path), without='other')
