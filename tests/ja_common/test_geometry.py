"""Rays, directions and postures: signs by hand, and conversions there and back."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ja_common.core.geometry import (
    angle_between,
    directions_of_rays,
    directions_of_vectors,
    finite_pair,
    head_rotation,
    rays_of_directions,
    vectors_of_directions,
    vectors_of_rays,
)

angles = st.tuples(st.floats(-1.2, 1.2), st.floats(-1.0, 1.0))
rays = st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8))


@pytest.mark.parametrize(
    ('vector', 'direction'),
    [
        ((1, 0, 0), (0, 0)),
        ((0, 1, 0), (math.pi / 2, 0)),  # left
        ((1, -1, 0), (-math.pi / 4, 0)),  # right
        ((1, 0, 1), (0, -math.pi / 4)),  # above
        ((1, 0, -1), (0, math.pi / 4)),  # below
    ],
)
def test_left_is_positive_pan_and_below_is_positive_tilt(vector, direction):
    assert directions_of_vectors(vector) == pytest.approx(direction)
    assert vectors_of_directions(direction) == pytest.approx(vector / np.linalg.norm(vector))


def test_right_of_the_centre_is_negative_pan_and_below_it_positive_tilt():
    right, below = directions_of_rays((0.0, 0.0), [(0.1, 0.0), (0.0, 0.1)])
    assert right == pytest.approx((-math.atan(0.1), 0.0))
    assert below == pytest.approx((0.0, math.atan(0.1)))


def test_head_turns_left_by_pan_and_down_by_tilt():
    left = head_rotation((math.pi / 2, 0.0))
    assert left @ (1, 0, 0) == pytest.approx((0, 1, 0))
    down = head_rotation((0.0, math.pi / 2))
    assert down @ (1, 0, 0) == pytest.approx((0, 0, -1))
    both = head_rotation((0.4, -0.3))
    assert both @ both.T == pytest.approx(np.eye(3))
    assert both @ (1, 0, 0) == pytest.approx(vectors_of_directions((0.4, -0.3)))


@given(angles)
def test_what_stands_in_the_centre_has_the_posture_as_its_direction(posture):
    assert directions_of_rays(posture, (0.0, 0.0)) == pytest.approx(posture, abs=1e-12)
    assert rays_of_directions(posture, posture) == pytest.approx((0, 0), abs=1e-12)


@given(angles, rays)
def test_ray_to_direction_and_back(posture, ray):
    direction = directions_of_rays(posture, ray)
    assert rays_of_directions(posture, direction) == pytest.approx(ray, abs=1e-9)


def test_what_is_behind_the_camera_has_no_ray():
    assert np.isnan(rays_of_directions((0.0, 0.0), (math.pi, 0.0))).all()
    assert not np.isnan(rays_of_directions((2.8, 0.0), (math.pi, 0.0))).any()


@given(angles, rays)
def test_a_ray_and_its_direction_are_the_same_vector(posture, ray):
    vector = vectors_of_rays(posture, ray)
    direction = vectors_of_directions(directions_of_rays(posture, ray))
    assert vector / np.linalg.norm(vector) == pytest.approx(direction, abs=1e-9)


def test_many_at_once_equal_one_by_one():
    posture = (0.3, -0.2)
    several = np.array([[[0.1, 0.2], [-0.3, 0.0]], [[0.0, 0.0], [0.5, -0.5]]])
    together = directions_of_rays(posture, several)
    assert together.shape == (2, 2, 2)
    for index in np.ndindex(2, 2):
        assert together[index] == pytest.approx(directions_of_rays(posture, several[index]))


def test_angle_is_that_of_the_great_circle():
    assert angle_between((0.0, 0.0), (0.3, 0.0)) == pytest.approx(0.3)
    assert angle_between((0.0, -0.2), (0.0, 0.1)) == pytest.approx(0.3)
    # Meridians converge: the same pan is a smaller angle high up.
    assert angle_between((0.0, math.pi / 3), (1e-3, math.pi / 3)) == pytest.approx(0.5e-3)
    # Tiny angles are exact where the arc cosine would give nought.
    assert angle_between((0.0, 0.0), (1e-9, 0.0)) == pytest.approx(1e-9)
    assert angle_between((0.0, 0.0), (math.pi, 0.0)) == pytest.approx(math.pi)


@pytest.mark.parametrize(
    'values', [(0.1,), (0.1, 0.2, 0.3), 0.1, (np.nan, 0.0), (0.0, np.inf), []]
)
def test_pair_that_is_not_two_finite_numbers_is_refused(values):
    with pytest.raises(ValueError, match=r'^a posture must be two finite numbers \(pan, tilt\)'):
        finite_pair('a posture', values)


def test_pair_is_a_copy():
    values = np.array([1, 2])
    pair = finite_pair('a posture', values)
    assert pair.tolist() == [1.0, 2.0]
    assert not np.shares_memory(pair, values)
