"""`internal_evaluator`: one fixation message an image, from the posture at the image's stamp."""

import math

import pytest

from ja_common.core.detection import Detection, Kind
from ja_common.detection_codec import encode_detections
from ja_common.topics import DETECTIONS, FIXATION, JOINT_STATES
from ja_learning.internal_evaluator_node import InternalEvaluatorNode
from node_bench import header, joint_state

MS = 1_000_000
BALL = Detection(Kind.OBJECT, 0.05, 0.0, 0, 0, 10, 10, 1.0)
FAR_BALL = Detection(Kind.OBJECT, 0.3, 0.0, 0, 0, 10, 10, 1.0)


@pytest.fixture
def bench(make_bench):
    return make_bench(InternalEvaluatorNode, [DETECTIONS, JOINT_STATES], [FIXATION])


def test_fixation_is_where_the_head_looked_when_the_image_was_taken(bench):
    """Not when the detections came: the newest joint state is far ahead."""
    for ms, pan in ((100, 0.1), (200, 0.1), (300, 0.9)):
        bench.publish_posture(ms * MS, pan)
    bench.wait(lambda: bench.received(JOINT_STATES) == 3)
    bench.publish(DETECTIONS, encode_detections(header(150 * MS), [BALL]))
    fixation = bench.next(FIXATION)
    assert fixation.header == header(150 * MS, '')
    assert list(fixation.position) == pytest.approx([0.1 - math.atan(0.05), 0.0], abs=1e-6)


def test_nothing_in_the_centre_is_said_too(bench):
    bench.publish_posture(100 * MS)
    for seen in ([FAR_BALL], []):
        bench.publish(DETECTIONS, encode_detections(header(100 * MS), seen))
        assert not bench.next(FIXATION).name


def test_moving_head_fixates_nothing(bench):
    bench.publish_posture(100 * MS, velocity=[0.5, 0.0])
    bench.publish(DETECTIONS, encode_detections(header(100 * MS), [BALL]))
    assert not bench.next(FIXATION).name


def test_image_waits_for_the_joint_states_of_its_time(bench):
    bench.publish(DETECTIONS, encode_detections(header(150 * MS), [BALL]))
    bench.publish_posture(100 * MS, 0.2)
    bench.wait(lambda: bench.received(JOINT_STATES) == 1)
    assert not bench.messages(FIXATION)
    bench.publish_posture(200 * MS, 0.2)
    assert bench.next(FIXATION).position[0] == pytest.approx(0.2 - math.atan(0.05))


def test_clock_set_back_is_survived_even_while_an_image_waits(bench):
    bench.publish_posture(90_000 * MS)
    bench.publish(DETECTIONS, encode_detections(header(90_100 * MS), [BALL]))
    bench.wait(lambda: bench.received(DETECTIONS) == 1)
    for ms in (1_000, 1_100):
        bench.publish_posture(ms * MS)
    bench.publish(DETECTIONS, encode_detections(header(1_050 * MS), [BALL]))
    assert bench.next(FIXATION).header == header(1_050 * MS, '')


@pytest.mark.parametrize(
    ('message', 'text'),
    [
        (joint_state(100 * MS, math.nan, 0.0), "the position of 'pan' is not finite: nan"),
        (joint_state(100 * MS, 0.0, 0.0, 0.0), "3 positions for 2 names: that of 'pan'"),
    ],
)
def test_broken_joint_state_is_one_clear_error_and_the_node_lives_on(bench, message, text):
    bench.publish(JOINT_STATES, message)
    bench.wait_for_complaint(f'/joint_states: {text}')
    bench.publish_posture(100 * MS)
    bench.publish(DETECTIONS, encode_detections(header(100 * MS), [BALL]))
    assert bench.next(FIXATION).name


def test_threshold_is_set_while_running(bench):
    bench.publish_posture(100 * MS)
    assert bench.set_parameter('d_th_rad', 0.01).successful
    bench.publish(DETECTIONS, encode_detections(header(100 * MS), [BALL]))
    assert not bench.next(FIXATION).name
    assert 'd_th_rad' in bench.set_parameter('d_th_rad', 0.0).reason
    assert 'nearest, most_salient' in bench.set_parameter('candidate', 'brightest').reason
