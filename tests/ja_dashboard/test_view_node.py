"""`view`: hears the graph at its own pace, and passes orders on."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_srvs.srv import SetBool, Trigger

from ja_common.core.config import Configuration, parameter
from ja_common.core.detection import Detection, Kind
from ja_common.core.health import Level
from ja_common.detection_codec import encode_detections
from ja_common.graph_node import GraphNode
from ja_common.image_codec import encode_camera_info, encode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.point_cloud_codec import encode_columns
from ja_common.topics import (
    BELIEF,
    CAMERA_INFO,
    DETECTIONS,
    DIAGNOSTICS,
    FIXATION,
    GATE_STATUS,
    IMAGE,
    JOINT_COMMANDS,
    JOINT_STATES,
    SCORE,
    SIM_TRUTH,
)
from ja_dashboard.core.view_model import RunState
from ja_dashboard.view_node import ViewNode
from node_bench import header

ALWAYS = [GATE_STATUS, FIXATION, SCORE, DIAGNOSTICS]
WATCHED = [IMAGE, CAMERA_INFO, JOINT_STATES, DETECTIONS, JOINT_COMMANDS, BELIEF]
FACE = Detection(Kind.FACE, 0.1, 0.0, 192.0, 120.0, 40.0, 50.0, 0.9)
FOCAL_PX = 160 / math.tan(math.radians(18))


def status(name='', level=DiagnosticStatus.OK, text='', **values):
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    return DiagnosticStatus(name=name, level=level, message=text, values=pairs)


@pytest.fixture
def bench(make_bench):
    bench = make_bench(ViewNode, publishes=ALWAYS)
    for topic in [*WATCHED, SIM_TRUTH]:
        publisher = bench.peer.create_publisher(topic.type, topic.name, topic.publisher_qos)
        bench._publishers[topic.name] = publisher
    wait_for_ears(bench, [GATE_STATUS, FIXATION])
    return bench


def hearers(bench, topic):
    return bench._publishers[topic.name].get_subscription_count()


def watch(bench):
    bench.node.watched()
    bench.wait(lambda: all(hearers(bench, topic) for topic in WATCHED))
    wait_for_ears(bench, WATCHED)


def wait_for_ears(bench, topics):
    """The page listens best-effort: what is said before *it* knows the speaker is lost."""
    bench.wait(lambda: all(bench.node.mailboxes[topic].publishers for topic in topics))


def say_image(bench, stamp_ns, detections=(FACE,)):
    head = header(stamp_ns)
    image = np.full((240, 320, 3), 90, np.uint8)
    joints = JointCodec(JointConfig())
    bench.publish(CAMERA_INFO, encode_camera_info(head, 320, 240, FOCAL_PX))
    bench.publish(JOINT_STATES, joints.encode_posture(head, [0.2, -0.1], [0.0, 0.0]))
    bench.publish(JOINT_COMMANDS, joints.encode_posture(head, [0.3, 0.0]))
    bench.publish(IMAGE, encode_image(image, head.stamp, 'eye'))
    bench.publish(DETECTIONS, encode_detections(head, list(detections)))


def test_images_are_heard_only_while_somebody_watches(bench):
    assert not any(hearers(bench, topic) for topic in WATCHED)
    watch(bench)
    bench.node._watched_s = -math.inf
    bench.wait(lambda: not any(hearers(bench, topic) for topic in WATCHED))


def test_an_image_is_shown_with_what_was_found_in_it(bench):
    watch(bench)
    say_image(bench, 5_000_000_000)
    # The posture may be known before the detections are.
    bench.wait(lambda: bench.node.frame.glance and len(bench.node.frame.glance.directions))
    frame = bench.node.frame
    assert frame.picture.stamp_ns == 5_000_000_000
    jpeg = cv2.imdecode(np.frombuffer(frame.picture.jpeg(), np.uint8), cv2.IMREAD_COLOR)
    assert np.ptp(jpeg) > 100, 'boxes are drawn on the grey'
    assert frame.glance.posture == pytest.approx((0.2, -0.1))
    assert frame.glance.command == pytest.approx((0.3, 0.0))
    # A ray to the right of the axis is a direction of less pan.
    assert frame.glance.directions[0, 0] == pytest.approx(0.2 - math.atan(0.1), abs=0.01)
    assert frame.glance.half_view[0] == pytest.approx(math.radians(18))
    assert frame.state.run is RunState.RUNNING
    assert 0 <= frame.latencies_ms[DETECTIONS.name] < 10_000


def test_a_picture_without_its_detections_waits_for_them(bench):
    watch(bench)
    head = header(7_000_000_000)
    bench.publish(IMAGE, encode_image(np.zeros((48, 64, 3), np.uint8), head.stamp, 'eye'))
    bench.wait(lambda: bench.node.frame.state.run is RunState.RUNNING)
    assert bench.node.frame.picture is None
    bench.publish(DETECTIONS, encode_detections(head, []))
    bench.wait(lambda: bench.node.frame.picture)


def test_the_belief_is_drawn_when_it_comes(bench):
    watch(bench)
    columns = {'pan': [0.1, 0.2], 'tilt': [0.0, 0.1], 'weight': [0.25, 0.75]}
    bench.publish(BELIEF, encode_columns(header(1), columns))
    say_image(bench, 1_000_000_000)
    bench.wait(lambda: bench.node.frame.glance)
    assert bench.node.frame.glance.belief == pytest.approx(
        np.array([[0.1, 0.0, 0.25], [0.2, 0.1, 0.75]])
    )


def test_the_truth_is_heard_on_request_only(bench):
    watch(bench)
    assert hearers(bench, SIM_TRUTH) == 0
    bench.node.show_truth(True)
    bench.wait(lambda: hearers(bench, SIM_TRUTH) == 1)
    wait_for_ears(bench, [SIM_TRUTH])
    rows = {'x': [0.8], 'y': [0.1], 'z': [0.0], 'pan': [0.12], 'tilt': [0.0], 'attended': [1.0]}
    bench.publish(SIM_TRUTH, encode_columns(header(1), rows))
    say_image(bench, 1_000_000_000)
    bench.wait(lambda: bench.node.frame.glance)
    assert bench.node.frame.glance.truth.attended == 0
    bench.node.watched()
    bench.node.show_truth(False)
    bench.wait(lambda: hearers(bench, SIM_TRUTH) == 0)


def test_trials_lights_and_complaints_are_gathered_unwatched(bench):
    ill = status('/gate', DiagnosticStatus.ERROR, 'stalled', rate='3')
    bench.publish(DIAGNOSTICS, DiagnosticArray(status=[ill]))
    bench.publish(GATE_STATUS, status(phase='shift', source='LM', p_lm='0.5', trials='3'))
    bench.wait(lambda: bench.node.frame.facts['source'] == 'LM')
    fixation = JointCodec(JointConfig()).encode(header(1), [0.1, 0.0])
    bench.publish(FIXATION, fixation)
    bench.publish(GATE_STATUS, status(phase='look', source='none', p_lm='0.5', trials='4'))
    bench.publish(SCORE, status(last='success'))
    bench.wait(lambda: 'success, last 1' in bench.node.frame.facts)
    bench.wait(lambda: bench.node.frame.facts.get('fixated by LM') == '100% of 1')
    [gate] = [light for light in bench.node.frame.lights if light.node == '/gate']
    assert (gate.level, gate.message) == (Level.ERROR, 'stalled')


def logged(bench, text):
    bench.wait(lambda: any(text in line for _, line in bench.node.frame.log))


def test_buttons_call_services_and_log_the_answer(bench):
    asked = []

    def answer(request, response):
        asked.append(getattr(request, 'data', None))
        response.success, response.message = len(asked) == 1, 'as you wish'
        return response

    bench.peer.create_service(SetBool, 'enable', answer)
    bench.peer.create_service(Trigger, 'home', answer)
    bench.wait(lambda: {'enable', 'home'} <= bench.node.frame.services)
    bench.node.switch('enable', False)
    logged(bench, 'enable: as you wish')
    bench.node.trigger('home')
    logged(bench, 'home: refused: as you wish')
    assert asked == [False, None]
    bench.node.trigger('sim/step')
    logged(bench, 'sim/step: nobody offers this service')


@dataclass(frozen=True)
class LiveConfig(Configuration):
    objects: int = parameter(3, 'how many', low=0, high=10)
    real_time_factor: float = parameter(0.0, 'how fast', low=0.0, high=100.0)


@pytest.fixture
def sim(bench, ros_context):
    """A node with the parameters of the simulation that the page sets."""
    sim = GraphNode('sim', context=ros_context)
    sim.configure(LiveConfig, lambda _: None)
    bench.executor.add_node(sim)
    yield sim
    sim.destroy_node()


def test_settings_are_read_set_and_refused(bench, sim):
    def settings():
        bench.node.watched()
        return bench.node.frame.settings

    bench.wait(lambda: settings().get('objects') == 3)
    bench.node.set('objects', 5)
    bench.wait(lambda: settings()['objects'] == 5)
    assert sim.get_parameter('objects').value == 5
    bench.node.set('real_time_factor', -2.0)
    logged(bench, 'real_time_factor: refused')
    assert sim.get_parameter('real_time_factor').value == 0.0


def test_it_says_nothing_to_the_robot(bench):
    """Only its own health: the page listens."""
    assert set(bench.node.published_topics.values()) == {DIAGNOSTICS}
    assert bench.node.get_parameter('host').value == '127.0.0.1', 'and to nobody outside'
