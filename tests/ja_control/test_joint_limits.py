"""The last word before the rig: no command leaves the limits, none is cut in silence."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ja_common.core.config import ConfigError
from ja_control.core.joint_limits import JointLimits, JointLimitsConfig

CONFIG = JointLimitsConfig(
    pan_min_rad=-1.0, pan_max_rad=0.8, tilt_min_rad=-0.5, tilt_max_rad=0.4, max_speed_rad_s=2.0
)
LIMITS = JointLimits(CONFIG)
LOW, HIGH = np.array([-1.0, -0.5]), np.array([0.8, 0.4])


def test_target_within_reach_is_taken_as_it_is():
    command = LIMITS.limit((0.15, -0.1), previous=(0.0, 0.0), seconds=0.1)
    assert command.posture == pytest.approx((0.15, -0.1))
    assert command.clamped == ''


def test_speed_is_limited_each_joint_by_itself():
    command = LIMITS.limit((0.5, -0.1), previous=(0.0, 0.0), seconds=0.1)
    assert command.posture == pytest.approx((0.2, -0.1))
    assert command.clamped == 'speed'


def test_position_is_limited():
    command = LIMITS.limit((0.9, -3.0), previous=(0.8, -0.5), seconds=0.1)
    assert command.posture == pytest.approx((0.8, -0.5))
    assert command.clamped == 'position'
    assert LIMITS.limit((9.0, 0.0), (0.0, 0.0), 0.1).clamped == 'position and speed'


@pytest.mark.parametrize('seconds', [0.0, -1.0])
def test_no_time_is_no_way(seconds):
    command = LIMITS.limit((0.5, 0.0), previous=(0.1, 0.2), seconds=seconds)
    assert command.posture == pytest.approx((0.1, 0.2))


def test_head_that_was_moved_out_of_the_limits_comes_back_in():
    command = LIMITS.limit((0.0, 0.0), previous=(1.4, 0.0), seconds=0.1)
    assert command.posture == pytest.approx((0.8, 0.0))


@pytest.mark.parametrize('target', [(np.nan, 0.0), (0.0, np.inf)])
def test_target_that_is_not_finite_is_refused(target):
    with pytest.raises(ValueError, match='not finite'):
        LIMITS.limit(target, (0.0, 0.0), 0.1)


@pytest.mark.parametrize('wrong', [{'pan_min_rad': 0.8}, {'tilt_max_rad': -0.6}])
def test_limits_must_leave_room(wrong):
    with pytest.raises(ConfigError, match='lower limit below its upper limit'):
        JointLimitsConfig(**{**CONFIG.__dict__, **wrong})


number = st.floats(-1e6, 1e6)
posture = st.tuples(number, number)


@given(posture, st.lists(st.tuples(posture, st.floats(-10, 10)), min_size=1, max_size=20))
def test_no_sequence_of_targets_leaves_the_limits(start, orders):
    previous = np.array(start)
    for target, seconds in orders:
        command = LIMITS.limit(target, previous, seconds).posture
        assert np.all((command >= LOW) & (command <= HIGH))
        # Relative to where it was, or, when that was outside, to the nearest limit.
        step = np.abs(command - np.clip(previous, LOW, HIGH))
        assert np.all(step <= 2.0 * max(seconds, 0.0) + 1e-9)
        previous = command
