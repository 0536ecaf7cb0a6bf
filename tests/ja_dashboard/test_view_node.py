"""`view`: polls the graph at its own rate, and passes requests on."""

import math
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

import cv2
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, Image, JointState, PointCloud2
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from ja_common.camera_info_codec import encode_camera_info
from ja_common.core.config import Configuration, parameter
from ja_common.core.detection import Detection, Kind
from ja_common.core.face_gaze import FaceGaze
from ja_common.core.health import Level
from ja_common.core.request_phase import RequestPhase
from ja_common.detection_codec import encode_detections
from ja_common.face_gaze_codec import encode_face_gaze
from ja_common.graph_node import GraphNode
from ja_common.image_codec import encode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.point_cloud_codec import encode_columns
from ja_common.topics import (
    BELIEF,
    CAMERA_INFO,
    CAREGIVER_REQUEST,
    DETECTIONS,
    DIAGNOSTICS,
    FACE_GAZE,
    FACE_IMAGE,
    FACE_LANDMARKS,
    FIXATION,
    GATE_STATUS,
    IMAGE,
    JOINT_COMMANDS,
    JOINT_STATES,
    SCORE,
    SIM_TRUTH,
    TRACK,
    WEIGHT_FILES,
)
from ja_common.weight_files_codec import encode_weight_files
from ja_dashboard.core.meeting_view import NumberedThing
from ja_dashboard.core.view_model import RunState
from ja_dashboard.view_node import ViewNode
from node_bench import header, joint_state

ALWAYS = [GATE_STATUS, FIXATION, SCORE, DIAGNOSTICS]
WATCHED = [IMAGE, CAMERA_INFO, JOINT_STATES, DETECTIONS, FACE_IMAGE, JOINT_COMMANDS, BELIEF]
FACE = Detection(Kind.FACE, 0.1, 0.0, 192.0, 120.0, 40.0, 50.0, 0.9)
FOCAL_PX = 160 / math.tan(math.radians(18))


def status(name='', level=DiagnosticStatus.OK, text='', **values):
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    return DiagnosticStatus(name=name, level=level, message=text, values=pairs)


@pytest.fixture
def bench(make_bench):
    return view_bench(make_bench)


def view_bench(make_bench, **parameters):
    bench = make_bench(ViewNode, publishes=ALWAYS, **parameters)
    for topic in [*WATCHED, SIM_TRUTH]:
        publisher = bench.peer.create_publisher(topic.type, topic.name, topic.publisher_qos)
        bench._publishers[topic.name] = publisher
    wait_for_publishers(bench, [GATE_STATUS, FIXATION])
    return bench


def subscribers(bench, topic):
    return bench._publishers[topic.name].get_subscription_count()


def watch(bench):
    bench.node.note_viewer()
    bench.wait(lambda: all(subscribers(bench, topic) for topic in WATCHED))
    wait_for_publishers(bench, WATCHED)


def wait_for_publishers(bench, topics):
    """Wait until the node knows the publishers: best effort loses all that comes before."""
    bench.wait(lambda: all(bench.node.polled_subscriptions[topic].publishers for topic in topics))


def publish_image(bench, stamp_ns, instead=MappingProxyType({})):
    """Publish all that comes with an image; `instead` has other messages by their topics."""
    head = header(stamp_ns)
    joints = JointCodec(JointConfig())
    messages = {
        CAMERA_INFO: encode_camera_info(head, 320, 240, FOCAL_PX),
        JOINT_STATES: joints.encode_posture(head, [0.2, -0.1], [0.0, 0.0]),
        JOINT_COMMANDS: joints.encode_posture(head, [0.3, 0.0]),
        IMAGE: encode_image(np.full((240, 320, 3), 90, np.uint8), head.stamp, 'eye'),
        DETECTIONS: encode_detections(head, [FACE]),
    }
    for topic, message in (messages | dict(instead)).items():
        if hasattr(message, 'header'):
            message.header.stamp = head.stamp
        bench.publish(topic, message)


def show_images(bench, is_shown, publish_more=lambda: None):
    """Publish images until the node shows a scene as `is_shown` asks; return the stamps [ns].

    One set of messages is not enough: a poll may come between two messages of a set.
    """
    stamps = []

    def shown():
        bench.node.note_viewer()
        stamps.append(5_000_000_000 + len(stamps) * 10_000_000)
        publish_more()
        publish_image(bench, stamps[-1])
        scene = bench.node.frame.scene
        return scene is not None and is_shown(scene)

    bench.wait(shown)
    return stamps


def test_images_are_received_only_with_a_viewer(bench):
    assert set(bench.node.polled_subscriptions) == {FIXATION, GATE_STATUS}
    watch(bench)
    bench.node._viewer_s = -math.inf
    bench.wait(lambda: not any(subscribers(bench, topic) for topic in WATCHED))
    assert set(bench.node.polled_subscriptions) == {FIXATION, GATE_STATUS}


def test_senses_are_subscribed_once_they_exist_and_only_with_a_viewer(bench):
    watch(bench)
    senses = {FACE_GAZE, FACE_LANDMARKS}
    show_images(bench, lambda scene: scene.command is not None)
    assert not senses & set(bench.node.polled_subscriptions)
    for topic in senses:
        publisher = bench.peer.create_publisher(topic.type, topic.name, topic.publisher_qos)
        bench._publishers[topic.name] = publisher

    def subscribed():
        bench.node.note_viewer()
        return all(subscribers(bench, topic) for topic in senses)

    bench.wait(subscribed)
    head = header(0)
    read = FaceGaze(np.array([0.3, 0.1, 0.0]), 0.03, np.full((2, 2), 0.1), 0.04)
    messages = {
        DETECTIONS: encode_detections(head, [FACE._replace(attended=True, gaze_read=True)]),
        FACE_GAZE: encode_face_gaze(head, read),
        FACE_LANDMARKS: encode_columns(head, {'u': [190.0, 195.0], 'v': [120.0, 121.0]}),
    }
    stamps = iter(range(9_000_000_000, 10**12, 10_000_000))

    def shown():
        bench.node.note_viewer()
        publish_image(bench, next(stamps), messages)
        picture = bench.node.frame.picture
        return (
            picture is not None and picture.gaze.gaze is not None and len(picture.gaze.landmarks)
        )

    bench.wait(shown)
    assert bench.node.frame.picture.gaze.landmarks == pytest.approx(
        np.array([[190, 120], [195, 121]])
    )
    assert bench.node.frame.scene.gaze == pytest.approx((0.4, 0.2))
    bench.node._viewer_s = -math.inf
    bench.wait(lambda: not any(subscribers(bench, topic) for topic in senses))


def test_the_facts_name_the_track_and_the_weight_files(make_bench):
    bench = make_bench(ViewNode, publishes=[TRACK, WEIGHT_FILES])
    assert 'track' not in bench.node.frame.facts
    bench.publish(TRACK, String(data='landmarks with depth'))
    bench.publish(WEIGHT_FILES, encode_weight_files('/eyes', {'face.onnx': 'a' * 64}))
    bench.wait(lambda: {'track', 'weight files'} <= bench.node.frame.facts.keys())
    assert bench.node.frame.facts['track'] == 'landmarks with depth'
    assert bench.node.frame.facts['weight files'] == f'face.onnx={"a" * 16}'


def test_an_image_is_shown_with_its_detections(bench):
    watch(bench)
    stamps = show_images(bench, lambda scene: len(scene.directions) and scene.command is not None)
    frame = bench.node.frame
    assert frame.picture.stamp_ns in stamps
    jpeg = cv2.imdecode(np.frombuffer(frame.picture.jpeg(), np.uint8), cv2.IMREAD_COLOR)
    assert np.ptp(jpeg) > 100, 'boxes are drawn on the grey'
    assert frame.scene.posture == pytest.approx((0.2, -0.1))
    assert frame.scene.command == pytest.approx((0.3, 0.0))
    # A ray to the right of the axis is a direction of less pan.
    assert frame.scene.directions[0, 0] == pytest.approx(0.2 - math.atan(0.1), abs=0.01)
    assert frame.scene.half_view[0] == pytest.approx(math.radians(18))
    assert frame.state.run is RunState.RUNNING
    assert 0 <= frame.latencies_ms[DETECTIONS.name] < 10_000


def test_the_picture_of_a_camera_on_its_side_is_shown_upright(make_bench):
    bench = view_bench(make_bench, image_rotation_deg=90)
    watch(bench)
    show_images(bench, lambda scene: bench.node.frame.picture is not None)
    picture = bench.node.frame.picture
    assert picture.image.shape == (320, 240, 3)
    assert (picture.camera.width, picture.camera.height) == (240, 320)
    half_view = math.atan(math.tan(math.radians(18)) * 240 / 320)
    bench.wait(lambda: bench.node.frame.scene.half_view[0] == pytest.approx(half_view))


def test_images_are_shown_beside_a_calibration_for_another_shape(bench):
    """A rig whose camera_info is wrong shows its images, and why the rest is not to be trusted."""
    watch(bench)
    upright = encode_camera_info(header(0), 240, 320, FOCAL_PX)
    stamps = []

    def is_shown():
        bench.node.note_viewer()
        stamps.append(5_000_000_000 + len(stamps) * 10_000_000)
        publish_image(bench, stamps[-1], instead={CAMERA_INFO: upright})
        picture = bench.node.frame.picture
        return picture is not None and 'camera_info' in bench.complaint()

    bench.wait(is_shown)
    assert 'the images are 320x240, but camera_info is for 240x320' in bench.complaint()
    assert bench.node.frame.scene.half_view[0] == pytest.approx(math.radians(18)), 'assumed'
    bench.node.frame.picture.jpeg()


def test_a_picture_without_its_detections_waits_for_them(bench):
    watch(bench)
    head = header(7_000_000_000)
    bench.publish(IMAGE, encode_image(np.zeros((48, 64, 3), np.uint8), head.stamp, 'eye'))
    bench.wait(lambda: bench.node.frame.state.run is RunState.RUNNING)
    assert bench.node.frame.picture is None
    bench.publish(DETECTIONS, encode_detections(head, []))
    bench.wait(lambda: bench.node.frame.picture)
    assert bench.node.frame.picture.stamp_ns == 7_000_000_000


def test_the_belief_is_drawn_when_it_comes(bench):
    watch(bench)
    columns = {'pan': [0.1, 0.2], 'tilt': [0.0, 0.1], 'weight': [0.25, 0.75]}
    show_images(
        bench,
        lambda scene: len(scene.belief),
        lambda: bench.publish(BELIEF, encode_columns(header(1), columns)),
    )
    assert bench.node.frame.scene.belief == pytest.approx(
        np.array([[0.1, 0.0, 0.25], [0.2, 0.1, 0.75]])
    )


def test_what_comes_between_the_images_is_shown(bench):
    watch(bench)
    show_images(bench, lambda scene: True)
    columns = {'pan': [0.1], 'tilt': [0.0], 'weight': [1.0]}
    bench.publish(BELIEF, encode_columns(header(1), columns))
    bench.wait(lambda: len(bench.node.frame.scene.belief))
    bench.publish(JOINT_COMMANDS, JointCodec(JointConfig()).encode(header(1), [0.4, 0.1]))
    bench.wait(lambda: bench.node.frame.scene.command == pytest.approx((0.4, 0.1)))


TOO_MANY = {name: np.zeros(5000) for name in ('pan', 'tilt', 'weight')}
BAD_MESSAGES = {
    'too few positions': (JOINT_STATES, JointState(name=['pan', 'tilt'], position=[0.0])),
    'joints that are NaN': (JOINT_STATES, joint_state(1, math.nan, 0.0)),
    'a command that is NaN': (JOINT_COMMANDS, joint_state(1, math.nan, 0.0)),
    'a calibration that is none': (CAMERA_INFO, CameraInfo(k=[-1.0] * 9)),
    'an unknown encoding': (IMAGE, Image(encoding='32FC1', width=1, height=1, step=4)),
    'an image without pixels': (IMAGE, Image(encoding='rgb8')),
    'an image that is cut off': (IMAGE, Image(encoding='rgb8', width=4, height=4, step=12)),
    'an image for no screen': (
        IMAGE, encode_image(np.zeros((2, 60_000, 3), np.uint8), header(0).stamp, 'eye')
    ),
    'detections of another field': (DETECTIONS, PointCloud2(width=9, height=9)),
    'detections at no place': (
        DETECTIONS, encode_detections(header(0), [FACE._replace(u=math.inf)])
    ),
    'a face that is none': (FACE_IMAGE, Image(encoding='mono8', width=3, height=3, step=3)),
    'a belief that is NaN': (
        BELIEF, encode_columns(header(1), {'pan': [math.nan], 'tilt': [0.0], 'weight': [1.0]})
    ),
    'a belief of other fields': (BELIEF, encode_columns(header(1), {'x': [1.0]})),
    'a belief of too many points': (BELIEF, encode_columns(header(1), TOO_MANY)),
}  # fmt: skip


def test_a_bad_message_costs_one_sentence_and_nothing_else(bench):
    """Every other image comes with a bad message; the page shows the images between them."""
    watch(bench)
    problems, stamps = [], []
    record_problem = bench.node.health.record_problem

    def keep(where, text, *args, **kwargs):
        problems.append(text)
        return record_problem(where, text, *args, **kwargs)

    bench.node.health.record_problem = keep

    def publish(instead):
        bench.node.note_viewer()
        stamps.append(5_000_000_000 + len(stamps) * 10_000_000)
        publish_image(bench, stamps[-1], instead=instead)

    def is_shown_after(stamp_ns):
        picture = bench.node.frame.picture
        return picture is not None and picture.stamp_ns > stamp_ns

    for name, (topic, message) in BAD_MESSAGES.items():
        problems.clear()

        def is_reported(topic=topic, message=message):
            publish({})
            publish({topic: message})
            return any(topic.name in text for text in problems)

        bench.wait(is_reported)
        assert not [text for text in problems if 'Traceback' in text], name
        before = stamps[-1]

        def is_over(before=before):
            publish({})
            return is_shown_after(before)

        bench.wait(is_over)
        picture, scene = bench.node.frame.picture, bench.node.frame.scene
        assert picture.image.shape == (240, 320, 3), name
        assert scene.command == pytest.approx((0.3, 0.0)), name
        assert scene.posture == pytest.approx((0.2, -0.1)), name


def test_a_status_of_no_level_hides_no_other_in_its_message(bench):
    odd, gate = status('/odd', b'\x09'), status('/gate', DiagnosticStatus.ERROR, 'stalled')
    bench.publish(DIAGNOSTICS, DiagnosticArray(status=[odd, gate]))
    bench.wait(lambda: any(node.node == '/gate' for node in bench.node.frame.node_health))
    bench.wait_for_complaint("level 9 of '/odd'")


def test_a_foreign_score_and_status_count_as_far_as_they_go(bench):
    bench.publish(GATE_STATUS, status(phase='shift', source='me' * 9999, p_lm='abc'))
    bench.wait(lambda: bench.node.frame.facts['p(LM)'] == 'abc')
    bench.publish(SCORE, status(last='success'))
    bench.wait(lambda: 'success, last 1' in bench.node.frame.facts)
    bench.publish(GATE_STATUS, status(phase='look', p_lm='0.5'))
    bench.wait(lambda: 'given up' in bench.node.frame.facts)
    assert bench.complaint() == 'OK'


def test_parameters_of_a_foreign_node_are_refused_with_a_sentence(bench):
    """It has the name of one of ours, and other parameters."""
    values = {
        'gate': [math.nan, 0.0, 1.0, 1.0],
        'sim': ['many'],
        'learning_module': [7],
    }  # fmt: skip

    def answer(name, _, response):
        response.values = [
            Parameter('x', value=value).get_parameter_value() for value in values[name]
        ]
        return response

    kinds = {
        'get_parameters': GetParameters, 'set_parameters': SetParameters,
        'list_parameters': ListParameters, 'describe_parameters': DescribeParameters,
        'get_parameter_types': GetParameterTypes,
        'set_parameters_atomically': SetParametersAtomically,
    }  # fmt: skip
    for node in values:
        for kind, service in kinds.items():
            reply = (
                partial(answer, node) if service is GetParameters else lambda _, response: response
            )
            bench.peer.create_service(service, f'{node}/{kind}', reply)
    watch(bench)
    show_images(bench, lambda _: 'limits' in bench.complaint())
    bench.wait_for_complaint("unusable value of objects: 'many'")
    bench.wait_for_complaint('unusable value of learner: 7')
    bench.node.set_remote_parameter('objects', 5)
    bench.wait_for_complaint('objects: not enough values')
    assert bench.node.frame.settings == {}
    assert bench.node.frame.scene.low == pytest.approx(np.radians([-60.0, -35.0]))


def test_the_truth_is_received_on_request_only(bench):
    watch(bench)
    assert SIM_TRUTH not in bench.node.polled_subscriptions
    bench.node.show_truth(True)
    bench.wait(lambda: subscribers(bench, SIM_TRUTH) == 1)
    wait_for_publishers(bench, [SIM_TRUTH])
    rows = {'x': [0.8], 'y': [0.1], 'z': [0.0], 'pan': [0.12], 'tilt': [0.0], 'attended': [1.0]}
    show_images(
        bench,
        lambda scene: scene.truth is not None,
        lambda: bench.publish(SIM_TRUTH, encode_columns(header(1), rows)),
    )
    assert bench.node.frame.scene.truth.attended == 0
    bench.node.show_truth(False)

    def unsubscribed():
        # With a viewer: without one the node unsubscribes from all images.
        bench.node.note_viewer()
        return subscribers(bench, SIM_TRUTH) == 0

    bench.wait(unsubscribed)
    assert subscribers(bench, IMAGE) == 1


def test_trials_health_and_errors_are_shown_without_a_viewer(bench):
    error = status('/gate', DiagnosticStatus.ERROR, 'stalled', rate='3')
    bench.publish(DIAGNOSTICS, DiagnosticArray(status=[error]))
    bench.publish(GATE_STATUS, status(phase='shift', source='LM', p_lm='0.5', trials='3'))
    bench.wait(lambda: bench.node.frame.facts['source'] == 'LM')
    fixation = JointCodec(JointConfig()).encode(header(1), [0.1, 0.0])
    bench.publish(FIXATION, fixation)
    bench.publish(GATE_STATUS, status(phase='shift', source='LM', p_lm='0.6', trials='3'))
    # Each poll takes the fixations first: the next one has the fixation before the end of trial.
    bench.wait(lambda: bench.node.frame.facts['p(LM)'] == '0.6')
    bench.publish(GATE_STATUS, status(phase='look', source='none', p_lm='0.5', trials='4'))
    bench.publish(SCORE, status(last='success'))
    bench.wait(lambda: 'success, last 1' in bench.node.frame.facts)
    bench.wait(lambda: bench.node.frame.facts.get('fixated by LM') == '100% of 1')
    bench.wait(lambda: any(node.node == '/gate' for node in bench.node.frame.node_health))
    [gate] = [node for node in bench.node.frame.node_health if node.node == '/gate']
    assert (gate.level, gate.message) == (Level.ERROR, 'stalled')


def wait_for_log(bench, text):
    bench.wait(lambda: any(text in line for _, line in bench.node.frame.log))


def test_buttons_call_services_and_log_the_answer(bench):
    asked = []

    def answer(request, response):
        asked.append(getattr(request, 'data', None))
        response.success, response.message = len(asked) == 1, 'done'
        return response

    bench.peer.create_service(SetBool, 'gate/enable', answer)
    bench.peer.create_service(Trigger, 'gate/home', answer)
    bench.wait(lambda: {'gate/enable', 'gate/home'} <= bench.node.frame.services)
    bench.node.call_switch('gate/enable', False)
    wait_for_log(bench, 'gate/enable: done')
    bench.node.call_trigger('gate/home')
    wait_for_log(bench, 'gate/home: refused: done')
    assert asked == [False, None]
    bench.node.call_trigger('sim/step')
    wait_for_log(bench, 'sim/step: no node offers this service')


def test_a_meeting_is_shown_without_a_viewer_and_grows_silent(make_bench):
    bench = make_bench(ViewNode, publishes=[CAREGIVER_REQUEST])
    assert bench.node.frame.meeting is None
    asked = status(text='Look at thing 3.', phase='thing', number='3', things='3 0.2 -0.1')
    bench.publish(CAREGIVER_REQUEST, asked)
    bench.wait(lambda: bench.node.frame.meeting)
    meeting = bench.node.frame.meeting
    assert (meeting.phase, meeting.number) == (RequestPhase.THING, 3)
    assert meeting.message == 'Look at thing 3.'
    assert meeting.things == (NumberedThing(3, (0.2, -0.1)),)
    bench.node._request_s -= 10.0
    bench.wait(lambda: bench.node.frame.meeting.is_silent)
    bench.publish(CAREGIVER_REQUEST, status(text='<b>', phase='a foreign one', number='many'))
    bench.wait(lambda: bench.node.frame.meeting.message == '<b>')
    assert not bench.node.frame.meeting.is_silent
    assert bench.complaint() == 'OK', 'what is odd in it is left out'


def test_a_meeting_is_paused_ended_and_its_things_are_moved_by_services(bench):
    asked = []

    def answer(name, request, response):
        asked.append((name, getattr(request, 'data', None)))
        response.success, response.message = True, 'done'
        return response

    services = {
        'caregiver/pause': SetBool,
        'caregiver/end': Trigger,
        'caregiver/rearranged': Trigger,
    }
    assert not services.keys() & bench.node.frame.services
    for name, service in services.items():
        bench.peer.create_service(service, name, partial(answer, name))
    bench.wait(lambda: services.keys() <= bench.node.frame.services)
    bench.node.call_switch('caregiver/pause', True)
    wait_for_log(bench, 'caregiver/pause: done')
    bench.node.call_trigger('caregiver/rearranged')
    wait_for_log(bench, 'caregiver/rearranged: done')
    bench.node.call_trigger('caregiver/end')
    wait_for_log(bench, 'caregiver/end: done')
    assert asked == [
        ('caregiver/pause', True),
        ('caregiver/rearranged', None),
        ('caregiver/end', None),
    ]


def test_the_last_pictures_are_kept_for_the_browser(bench):
    watch(bench)
    stamps = show_images(bench, lambda _: len(bench.node.frame.recent) == 4)
    frame = bench.node.frame
    assert frame.recent[-1] is frame.picture
    assert {each.stamp_ns for each in frame.recent} <= set(stamps)
    bench.node._viewer_s = -math.inf
    bench.wait(lambda: bench.node.frame.recent == ())


@dataclass(frozen=True)
class LiveConfig(Configuration):
    objects: int = parameter(3, 'how many', low=0, high=10)
    real_time_factor: float = parameter(0.0, 'how fast', low=0.0, high=100.0)


@pytest.fixture
def sim(bench, ros_context):
    """Return a node with the parameters of the simulation that the page sets."""
    sim = GraphNode('sim', context=ros_context)
    sim.configure(LiveConfig, lambda _: None)
    bench.executor.add_node(sim)
    yield sim
    sim.destroy_node()


def test_settings_are_read_set_and_refused(bench, sim):
    def settings():
        bench.node.note_viewer()
        return bench.node.frame.settings

    bench.wait(lambda: settings().get('objects') == 3)
    bench.node.set_remote_parameter('objects', 5)
    bench.wait(lambda: settings()['objects'] == 5)
    assert sim.get_parameter('objects').value == 5
    bench.node.set_remote_parameter('real_time_factor', -2.0)
    wait_for_log(bench, 'real_time_factor: refused')
    assert sim.get_parameter('real_time_factor').value == 0.0


def test_it_publishes_nothing_to_the_robot(bench):
    """It publishes only its own health."""
    assert set(bench.node.published_topics.values()) == {DIAGNOSTICS}
    assert bench.node.get_parameter('host').value == '127.0.0.1', 'and serves no other machine'
