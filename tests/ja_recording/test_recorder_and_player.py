"""A graph is recorded, and the recording is played back as a graph."""

import re
import signal
import subprocess
import sys
from dataclasses import replace

import pytest
from diagnostic_msgs.msg import KeyValue
from rclpy.serialization import deserialize_message
from rosbags.highlevel import AnyReader
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float32

from foreign_bags import FLOAT, RATES, write_db3, write_mcap
from ja_common.core.config import ConfigError
from ja_common.ros_defaults import ros_distro
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import (
    CLOCK,
    GATE_STATUS,
    IMAGE,
    IMAGE_ANNOTATED,
    NEW_NAMES,
    OLD_FACE,
    OLD_TARGET,
    SUCCESS_RATE,
    TARGET,
    TOPICS,
)
from ja_recording.core.reader import Recording
from ja_recording.player_node import PlayerNode
from ja_recording.recorder_node import RecorderNode
from ja_recording.recording_folder import Limits, RecordingFolder
from recordings import T0_NS, channel_of, write_recording
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
    assert not {'/image_annotated', f'/{TARGET.name}'} & names


def test_what_comes_under_two_names_is_recorded_once(make_bench, tmp_path):
    bench = make_bench(RecorderNode, folder=str(tmp_path / 'r'), exclude=ALWAYS_PUBLISHED)
    topics = (OLD_TARGET, TARGET, OLD_FACE)
    publishers = {t: bench.peer.create_publisher(t.type, t.name, t.publisher_qos) for t in topics}
    recorded = (publishers[TARGET], publishers[OLD_FACE])
    bench.wait(lambda: all(p.get_subscription_count() for p in recorded))
    assert bench.node.topics == 2, 'an old name alone is recorded'
    assert not publishers[OLD_TARGET].get_subscription_count()


def test_another_library_decodes_every_type_of_the_graph(make_bench, tmp_path):
    """The schemas in the file suffice: this project writes, rosbags reads."""
    bench = make_bench(RecorderNode, folder=str(tmp_path / 'r'), exclude=ALWAYS_PUBLISHED)
    left_out = f'{ALWAYS_PUBLISHED}|^({"|".join(NEW_NAMES)})$'
    topics = [topic for topic in TOPICS if not re.match(left_out, topic.name)]
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


def values(bench) -> list[float]:
    """Return what came on a latched topic; of a burst, only the last message is sure to come."""
    return [message.data for message in bench.messages(SUCCESS_RATE)]


def logged(capfd) -> str:
    return capfd.readouterr().err


@pytest.mark.parametrize('write', [write_mcap, write_db3])
def test_a_type_that_is_not_installed_blocks_no_other(write, make_bench, tmp_path, capfd):
    """The other topics are played, and the message names the topic, its type, and what to do."""
    unknown = ('/lidar', 'velodyne_msgs/msg/VelodyneScan', 'cdr')
    service = ('/set/_service_event', 'std_srvs/srv/SetBool_Event', 'cdr')
    topics = [('/sim/success_rate', FLOAT, 'cdr'), unknown, service]
    path = write(tmp_path / ('x.mcap' if write is write_mcap else 'x.db3'), topics)
    parameters = {'recording': str(path), 'start_after_s': 0.2}
    bench = make_bench(PlayerNode, subscribes=[SUCCESS_RATE], **parameters)
    bench.wait(lambda: bench.node.done and 5.0 in values(bench))
    assert bench.node.played == len(RATES)
    said = logged(capfd)
    assert said.count('/lidar is left out') == 1
    assert f'ros-{ros_distro()}-velodyne-msgs' in said
    assert '--without /lidar' in said
    assert '/set/_service_event is left out' in said


def test_what_is_left_out_is_not_looked_up(make_bench, tmp_path, capfd):
    topics = [
        ('/sim/success_rate', FLOAT, 'cdr'),
        ('/a', 'x_msgs/msg/X', 'cdr'),
        ('/b', '', 'json'),
    ]
    path = write_mcap(tmp_path / 'x.mcap', topics)
    bench = make_bench(PlayerNode, recording=str(path), without='/a,b', start_after_s=0.0)
    bench.wait(lambda: bench.node.done)
    assert 'left out' not in logged(capfd)


def test_a_recording_of_unknown_types_alone_is_refused(make_bench, tmp_path):
    path = write_mcap(tmp_path / 'x.mcap', [('/a', 'x_msgs/msg/X', 'cdr')])
    with pytest.raises(ConfigError, match='no topic of it can be published'):
        make_bench(PlayerNode, recording=str(path))


def test_a_gap_of_years_is_skipped_and_named(make_bench, tmp_path, capfd):
    """Recorded with --use-sim-time: time 0 until the first /clock."""
    path = write_mcap(
        tmp_path / 'x.mcap', [('/sim/success_rate', FLOAT, 'cdr')],
        stamps_ns=(0, 0, T0_NS, T0_NS + 10**8), data=RATES,
    )  # fmt: skip
    bench = make_bench(
        PlayerNode, subscribes=[SUCCESS_RATE, CLOCK], recording=str(path), start_after_s=0.2
    )
    bench.wait(lambda: bench.node.done and 3.0 in values(bench))
    assert bench.node.length_s == pytest.approx(0.1)
    assert 'The clock of the recorder was set' in logged(capfd)
    clock = [to_ns(message.clock) for message in bench.messages(CLOCK)]
    assert clock == sorted(clock)
    assert clock[-1] < T0_NS + 10**10


def test_a_quality_of_service_that_cannot_be_read_blocks_no_topic(make_bench, tmp_path, capfd):
    folder = RecordingFolder(tmp_path / 'r', Limits())
    channel = replace(channel_of(SUCCESS_RATE), offered_qos='- what: is this')
    folder.write_message(channel, RATES[0], T0_NS, T0_NS, 0)
    folder.close()
    bench = make_bench(PlayerNode, recording=str(tmp_path / 'r'), start_after_s=0.2)
    bench.wait(lambda: bench.node.done)
    assert bench.node.played == 1
    assert 'quality of service of /sim/success_rate cannot be read' in logged(capfd)
