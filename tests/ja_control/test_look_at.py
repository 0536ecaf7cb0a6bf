"""From a point in either frame to a direction, and the points that are refused."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ja_common.core.config import ConfigError
from ja_common.core.geometry import angle_between, rays_of_directions, vectors_of_directions
from ja_control.core.joint_limits import JointLimits, JointLimitsConfig
from ja_control.core.look_at import LookAtConfig, base_vector, checked_point, direction_to_take

LIMITS = JointLimits(JointLimitsConfig())
ANGLES = st.floats(-1.2, 1.2)


def direction(point):
    return direction_to_take(checked_point(point), LIMITS.reachable)


@pytest.mark.parametrize(
    ('point', 'pan', 'tilt'),
    [
        ((2.0, 0.0, 0.0), 0.0, 0.0),
        ((1.0, 1.0, 0.0), math.pi / 4, 0.0),
        ((1.0, 0.0, -1.0), 0.0, math.pi / 4),
        ((1e300, -1e300, 0.0), -math.pi / 4, 0.0),
        ((1e-5, 0.0, 1e-5), 0.0, -math.pi / 4),
        ((0.0, 3.0, 0.0), math.pi / 2, 0.0),
    ],
)
def test_point_in_the_base_frame(point, pan, tilt):
    """Left is positive pan, below is positive tilt; the distance does not matter."""
    assert direction(point) == pytest.approx((pan, tilt))


@given(ANGLES, ANGLES, ANGLES, ANGLES, st.floats(0.1, 50.0))
def test_point_seen_by_the_camera_is_where_it_is_seen(pan, tilt, at_pan, at_tilt, depth):
    """What stands at a ray of the picture has the direction of that ray, at any distance."""
    posture, wanted = np.array([at_pan, at_tilt]), np.array([pan, tilt])
    ray = rays_of_directions(posture, wanted)
    if np.isnan(ray).any() or np.abs(ray).max() > 20:
        return
    vector = base_vector(checked_point([*(depth * ray), depth]), posture)
    assert vector == pytest.approx(vectors_of_directions(wanted), abs=1e-9)
    assert angle_between(direction_to_take(vector, LIMITS.reachable), wanted) < 1e-6


@pytest.mark.parametrize(
    ('point', 'reason'),
    [
        ((math.nan, 0.0, 1.0), 'the point is not finite'),
        ((1.0, math.inf, 1.0), 'the point is not finite'),
        ((0.0, 0.0, 0.0), 'it has no direction'),
        ((1e-9, 0.0, 0.0), 'it has no direction'),
        ((-1.0, 0.0, 0.0), 'the point is behind the head, at pan 3.14 and tilt -0.00 rad'),
        ((-0.1, 1.0, 0.0), 'the point is behind the head'),
    ],
)
def test_point_that_cannot_be_looked_at(point, reason):
    with pytest.raises(ValueError, match=reason):
        direction(point)


def test_a_head_that_can_turn_round_looks_behind_itself():
    wide = JointLimits(JointLimitsConfig(pan_min_rad=-3.1, pan_max_rad=3.1))
    wanted = direction_to_take(checked_point((-1.0, 1.0, 0.0)), wide.reachable)
    assert wanted == pytest.approx((3 * math.pi / 4, 0.0))


def test_frames_have_names():
    config = LookAtConfig(base_frame='torso')
    assert config.is_camera_frame('camera_optical_frame')
    assert not config.is_camera_frame('torso')
    with pytest.raises(ValueError, match=r"'map' is not known: give the point in 'torso'"):
        config.is_camera_frame('map')
    with pytest.raises(ConfigError, match='need two names'):
        LookAtConfig(camera_frame='base_link')
