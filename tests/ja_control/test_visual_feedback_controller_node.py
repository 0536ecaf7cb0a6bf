"""`visual_feedback_controller`: Eq. 2 on every detections message, with its own header."""

import array

import pytest

from ja_common.core.detection import Detection, Kind
from ja_common.detection_codec import encode_detections
from ja_common.topics import DETECTIONS, FACE_DELTA, VF_DELTA
from ja_control.visual_feedback_controller_node import VisualFeedbackControllerNode
from node_bench import header

FACE = Detection(Kind.FACE, -0.1, 0.2, 0, 0, 10, 10, 1.0)
FAINT = Detection(Kind.OBJECT, 0.0, 0.0, 0, 0, 10, 10, 0.2)
BRIGHT = Detection(Kind.OBJECT, 0.25, -0.125, 0, 0, 10, 10, 0.9)


@pytest.fixture
def make(make_bench):
    def make(**parameters):
        subscribes = [VF_DELTA, FACE_DELTA]
        return make_bench(VisualFeedbackControllerNode, [DETECTIONS], subscribes, **parameters)

    return make


def answers(bench, stamp_ns, detections):
    """Return the deltas to the target and to the face for one message of detections."""
    bench.publish(DETECTIONS, encode_detections(header(stamp_ns), detections))
    bench.wait(lambda: all(stamps(bench, t)[-1:] == [stamp_ns] for t in (VF_DELTA, FACE_DELTA)))
    return bench.messages(VF_DELTA)[-1], bench.messages(FACE_DELTA)[-1]


def stamps(bench, topic):
    return [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in bench.messages(topic)]


def test_most_salient_object_and_face_are_each_centred(make):
    target, face = answers(make(), 1_500_000_007, [FAINT, BRIGHT, FACE])
    assert list(target.name) == list(face.name) == ['pan', 'tilt']
    assert list(target.position) == pytest.approx([-0.25, -0.125])
    assert list(face.position) == pytest.approx([0.1, 0.2])
    assert target.header == face.header == header(1_500_000_007, ''), 'the stamp is unchanged'


def test_nothing_seen_is_answered_too(make):
    bench = make()
    target, face = answers(bench, 1, [])
    assert not target.name
    assert not face.name
    target, face = answers(bench, 2, [FACE])
    assert not target.name, 'a face is no target'
    assert face.name


def test_gain_is_set_while_running_and_a_bad_one_changes_nothing(make):
    bench = make()
    assert bench.set_parameter('gain', 0.5).successful
    assert list(answers(bench, 1, [BRIGHT])[0].position) == pytest.approx([-0.125, -0.0625])
    assert bench.set_parameter('gain', 2).successful, 'a whole number will do'
    assert list(answers(bench, 2, [BRIGHT])[0].position) == pytest.approx([-0.5, -0.25])
    for bad in (-1.0, 'loud', float('nan')):
        result = bench.set_parameter('gain', bad)
        assert not result.successful
        assert 'gain' in result.reason
    assert list(answers(bench, 3, [BRIGHT])[0].position) == pytest.approx([-0.5, -0.25])


def test_rig_with_other_names_and_signs(make):
    bench = make(pan_joint='neck', tilt_inverted=True)
    target, _ = answers(bench, 1, [BRIGHT])
    assert list(target.name) == ['neck', 'tilt']
    assert list(target.position) == pytest.approx([-0.25, 0.125])


def no_data(message):
    message.data = array.array('B')


def lacks_a_field(message):
    message.fields = [field for field in message.fields if field.name != 'score']


def not_finite(message):
    message.data[0:4] = array.array('B', b'\x00\x00\xc0\x7f')


@pytest.mark.parametrize(
    ('spoil', 'text'),
    [
        (no_data, '/detections: a point cloud of 1 points of 68 bytes holds 0 bytes'),
        (lacks_a_field, "/detections: the point cloud lacks the fields ['score']"),
        (not_finite, '/detections: detections hold numbers that are not finite'),
    ],
)
def test_broken_message_is_one_clear_error_and_the_node_lives_on(make, spoil, text):
    bench = make()
    message = encode_detections(header(1), [BRIGHT])
    spoil(message)
    bench.publish(DETECTIONS, message)
    bench.wait_for_complaint(text)
    answers(bench, 2, [BRIGHT])
    assert stamps(bench, VF_DELTA) == [2], 'no answer to the broken message'
