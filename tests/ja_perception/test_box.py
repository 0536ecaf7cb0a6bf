"""Boxes: how they scale with their image, and how far they overlap."""

import numpy as np
import pytest

from ja_perception.core.box import Box, corners, overlaps, scaled


def test_a_box_keeps_its_borders_in_a_larger_image():
    # Pixels 2 to 5 of a row become pixels 6 to 17 of one three times as long.
    box = Box(u=3.5, v=3.5, width=4, height=4).scaled(3)
    assert box == Box(u=11.5, v=11.5, width=12, height=12)
    assert box.scaled(1 / 3) == pytest.approx(Box(3.5, 3.5, 4, 4))


def test_many_boxes_at_once_are_as_one_by_one():
    boxes = [Box(3.5, 3.5, 4, 4), Box(10, 20, 5, 7)]
    together = np.array(boxes)
    assert np.array_equal(scaled(together, 3), [box.scaled(3) for box in boxes])
    assert np.array_equal(corners(together), [[1.5, 1.5, 5.5, 5.5], [7.5, 16.5, 12.5, 23.5]])


def test_overlaps_are_shares_of_the_smaller_box():
    large, inside, beside = Box(10, 10, 20, 20), Box(5, 5, 2, 4), Box(30, 10, 20, 20)
    half_out, empty = Box(20, 10, 10, 10), Box(10, 10, 0, 0)
    shares = overlaps([large, half_out], [inside, beside, half_out, empty])
    assert shares == pytest.approx(np.array([[1, 0, 0.5, 0], [0, 0.5, 1, 0]]))
    assert large.overlap(half_out) == half_out.overlap(large) == 0.5


def test_no_boxes_have_no_overlaps():
    assert overlaps([], [Box(1, 1, 1, 1)]).shape == (0, 1)
