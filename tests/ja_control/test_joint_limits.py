"""Position limits, and the margin that no target enters."""

import pytest

from ja_common.core.config import ConfigError
from ja_control.core.joint_limits import JointLimits, JointLimitsConfig

CONFIG = JointLimitsConfig(
    pan_min_rad=-1.0, pan_max_rad=0.8, tilt_min_rad=-0.5, tilt_max_rad=0.4, soft_margin_rad=0.05
)
LIMITS = JointLimits(CONFIG)


def test_posture_is_clipped_to_the_limits_and_a_target_to_the_margin_inside():
    assert LIMITS.clip((0.9, -3.0)) == pytest.approx((0.8, -0.5))
    assert LIMITS.reachable((0.9, -3.0)) == pytest.approx((0.75, -0.45))
    assert LIMITS.reachable((0.1, 0.2)) == pytest.approx((0.1, 0.2))


def test_excess_is_that_of_the_joint_farthest_out():
    assert LIMITS.excess_rad((0.9, -0.7)) == pytest.approx(0.2)
    assert LIMITS.excess_rad((0.8, 0.0)) == 0.0


@pytest.mark.parametrize(
    ('wrong', 'text'),
    [
        ({'pan_min_rad': 0.8}, 'lower limit below its upper limit'),
        ({'tilt_max_rad': -0.6}, 'lower limit below its upper limit'),
        ({'soft_margin_rad': 0.45}, 'leaves no room'),
    ],
)
def test_limits_must_leave_room(wrong, text):
    with pytest.raises(ConfigError, match=text):
        JointLimitsConfig(**{**CONFIG.__dict__, **wrong})
