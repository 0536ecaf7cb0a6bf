"""Eq. 3: d_th of a sixth of the image's width."""

import math

import numpy as np
import pytest

from ja_common.core.fixation import WIDTH_SIXTH, nearest_to_centre, stands_in_centre


def test_d_th_is_a_sixth_of_the_width_at_the_view_of_the_paper():
    width_px = 320
    focal_px = width_px / 2 / math.tan(math.radians(18))
    just_inside, just_outside = np.array([-0.01, 0.01]) + width_px / 6
    for towards in np.array([(1, 0), (0, -1), (-0.6, 0.8)]):
        assert stands_in_centre(towards * just_inside / focal_px, WIDTH_SIXTH)
        assert not stands_in_centre(towards * just_outside / focal_px, WIDTH_SIXTH)
    assert math.degrees(WIDTH_SIXTH) == pytest.approx(6.18, abs=0.005)


def test_threshold_itself_is_outside():
    assert not stands_in_centre((math.tan(0.1), 0.0), 0.1)


def test_nearest_within_the_threshold():
    assert nearest_to_centre([(0.09, 0.0), (0.03, -0.04), (-0.3, 0.0)], 0.1) == 1
    assert nearest_to_centre([(0.2, 0.0), (0.0, 0.3)], 0.1) is None
    assert nearest_to_centre([], 0.1) is None
