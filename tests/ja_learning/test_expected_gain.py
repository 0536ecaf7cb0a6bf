"""What a belief expects to gain over a choice by chance."""

import math

import numpy as np
import pytest

from ja_learning.core.gaze_line_belief import GazeLineBelief
from ja_learning.core.gaze_table import level_mixture
from ja_learning.core.trial import Look

LOOK = Look(np.zeros((30, 25), np.uint8), np.zeros(2))
ON_LINE, OFF_LINE = (0.3, 0.05), (-0.3, 0.1)


def belief(calibrated: bool = True) -> GazeLineBelief:
    """Return a belief that she looks to the left and a little down."""
    gaze = np.array([[[0.6, 0.1]]])
    mixture = level_mixture(np.array([3]))
    return GazeLineBelief(
        lambda look: look.face,
        lambda faces: gaze,
        mixture,
        np.zeros(1),
        0.0,
        True,
        4.5,
        calibrated=calibrated,
    )


def test_one_on_the_line_of_gaze_is_nearly_certain():
    one = belief()
    assert one.expected_gain(LOOK, [ON_LINE, OFF_LINE]) > 0.99
    assert one.expected_gain(LOOK, [ON_LINE, ON_LINE]) == pytest.approx(0.0)


def test_the_gain_follows_from_the_probabilities():
    one, candidates = belief(), [ON_LINE, (0.32, 0.02), (0.2, 0.1), OFF_LINE]
    shares = one.probabilities(LOOK, candidates)
    assert shares is not None
    assert shares.sum() == pytest.approx(1.0)
    gain = one.expected_gain(LOOK, candidates)
    assert gain == pytest.approx((shares.max() - 0.25) / 0.75)


def test_other_candidates_get_another_answer():
    """The last answer is kept for the same candidates only."""
    one = belief()
    for candidates in ([ON_LINE, OFF_LINE], [OFF_LINE, ON_LINE], [ON_LINE, (0.29, 0.06)]):
        found = one.probabilities(LOOK, candidates)
        assert found is not None
        fresh = belief().probabilities(LOOK, candidates)
        assert fresh is not None
        assert np.array_equal(found, fresh)


@pytest.mark.parametrize('candidates', [[], [ON_LINE]])
def test_without_a_choice_it_is_unknown(candidates: list):
    assert math.isnan(belief().expected_gain(LOOK, np.reshape(candidates, (-1, 2))))


def test_without_calibration_it_is_unknown():
    assert math.isnan(belief(calibrated=False).expected_gain(LOOK, [ON_LINE, OFF_LINE]))
