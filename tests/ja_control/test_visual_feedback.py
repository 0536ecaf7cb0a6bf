"""Eq. 2: (dpan, dtilt) = g (x - c_x, y - c_y), in the axes of REP-103."""

import pytest

from ja_control.core.visual_feedback import visual_feedback


@pytest.mark.parametrize(
    ('ray', 'gain', 'delta'),
    [
        ((0.0, 0.0), 1.0, (0.0, 0.0)),
        ((0.2, 0.0), 1.0, (-0.2, 0.0)),  # right of the centre: turn right
        ((-0.2, 0.0), 1.0, (0.2, 0.0)),  # left: turn left
        ((0.0, 0.1), 1.0, (0.0, 0.1)),  # below: turn down
        ((0.2, -0.1), 0.5, (-0.1, -0.05)),
        ((0.2, -0.1), 0.0, (0.0, 0.0)),
    ],
)
def test_equation_2(ray, gain, delta):
    assert visual_feedback(ray, gain) == pytest.approx(delta)
