"""The internal evaluator: Eq. 3 while the head stands still, for whichever object is fixated."""

import math

import numpy as np
import pytest

from ja_common.core.detection import Detection, Kind
from ja_common.core.posture import Posture
from ja_learning.core.evaluator import EvaluatorConfig, InternalEvaluator

NEAREST = InternalEvaluator(EvaluatorConfig(d_th_rad=0.1))
MOST_SALIENT = InternalEvaluator(EvaluatorConfig(d_th_rad=0.1, candidate='most_salient'))


def ball(x, y=0.0, score=1.0):
    return Detection(Kind.OBJECT, x, y, 0, 0, 10, 10, score)


def face(x, y=0.0):
    return Detection(Kind.FACE, x, y, 0, 0, 10, 10, 1.0)


def head(pan=0.0, tilt=0.0, velocity=(0.0, 0.0)):
    return Posture(0, np.array([pan, tilt]), np.array(velocity))


def test_fixation_is_the_direction_of_the_object_not_of_the_camera():
    direction = NEAREST.find_fixation([ball(0.05, -0.02)], head(pan=0.3))
    assert direction == pytest.approx((0.3 - math.atan(0.05), math.atan(-0.02)), abs=1e-4)


def test_object_outside_d_th_is_not_fixated():
    assert NEAREST.find_fixation([ball(0.11)], head()) is None
    assert NEAREST.find_fixation([ball(0.08, 0.08)], head()) is None, 'the distance, not each axis'
    assert NEAREST.find_fixation([], head()) is None


def test_nearest_object_counts_however_faint():
    seen = [ball(0.09, score=9.0), ball(-0.02, score=0.1)]
    assert NEAREST.find_fixation(seen, head())[0] == pytest.approx(math.atan(0.02))


def test_most_salient_of_the_view_may_be_asked_instead():
    near = ball(-0.02, score=0.1)
    assert MOST_SALIENT.find_fixation([near, ball(0.5, score=9.0)], head()) is None
    assert MOST_SALIENT.find_fixation([near, ball(0.09, score=9.0)], head())[0] == pytest.approx(
        -math.atan(0.09)
    )


def test_face_nearer_to_the_centre_is_what_the_head_watches():
    assert NEAREST.find_fixation([ball(0.05), face(0.02)], head()) is None
    assert NEAREST.find_fixation([ball(0.05), face(0.07)], head()) is not None


@pytest.mark.parametrize('velocity', [(0.06, 0.0), (0.0, -0.06)])
def test_nothing_is_fixated_while_the_head_moves(velocity):
    assert NEAREST.find_fixation([ball(0.0)], head(velocity=velocity)) is None
    assert (
        NEAREST.find_fixation([ball(0.0)], head(velocity=np.multiply(velocity, 0.5))) is not None
    )


def test_a_glance_is_no_fixation():
    """The head must have stood still in one posture for so long."""
    evaluator = InternalEvaluator(EvaluatorConfig(d_th_rad=0.1, hold_s=0.15))

    def seen(stamp_s, pan=0.0, velocity=(0.0, 0.0)):
        posture = Posture(round(stamp_s * 1e9), np.array([pan, 0.0]), np.array(velocity))
        return evaluator.find_fixation([ball(0.0)], posture) is not None

    assert [seen(0.0), seen(0.1), seen(0.2), seen(0.3)] == [False, False, True, True]
    assert [seen(0.4, pan=0.5), seen(0.5, pan=0.5)] == [False, False], 'turned between two images'
    assert [seen(0.6, pan=0.5), seen(0.7, 0.5, (0.3, 0.0)), seen(0.8, 0.5)] == [True, False, False]
    assert not seen(0.2, pan=0.5), 'the clock was set back: it starts again'
    assert seen(0.4, pan=0.5)


@pytest.mark.parametrize('bad', [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_never_good_enough(bad):
    assert NEAREST.find_fixation([ball(0.0)], head(velocity=(bad, 0.0))) is None
    assert NEAREST.find_fixation([ball(bad)], head()) is None
    if math.isnan(bad):  # a face so far out that it is infinite is not nearer than the object
        assert NEAREST.find_fixation([ball(0.0), face(bad)], head()) is None
