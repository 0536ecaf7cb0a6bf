"""Limits of each joint: position, soft margin, speed, acceleration."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import ConfigError, Configuration, parameter


@dataclass(frozen=True)
class JointLimitsConfig(Configuration):
    """Limits of the two joints; the defaults suit the paper's head, and people in front of it."""

    pan_min_rad: float = parameter(-1.05, 'rightmost pan', low=-3.15, high=3.15)
    pan_max_rad: float = parameter(1.05, 'leftmost pan', low=-3.15, high=3.15)
    tilt_min_rad: float = parameter(-0.61, 'highest tilt (up is negative)', low=-1.57, high=1.57)
    tilt_max_rad: float = parameter(0.61, 'lowest tilt (down is positive)', low=-1.57, high=1.57)
    soft_margin_rad: float = parameter(
        0.02, 'no target is nearer to a position limit than this', low=0.0, high=0.5
    )
    max_speed_rad_s: float = parameter(
        2.0, 'fastest change of the commanded posture of each joint', low=0.01, high=50.0
    )
    max_acceleration_rad_s2: float = parameter(
        40.0, 'fastest change of that speed', low=0.01, high=1e4
    )

    def check_together(self) -> None:
        """Raise ConfigError when the limits leave a joint no room to move."""
        room = min(self.pan_max_rad - self.pan_min_rad, self.tilt_max_rad - self.tilt_min_rad)
        if room <= 0.0:
            raise ConfigError('each joint needs a lower limit below its upper limit')
        if room <= 2 * self.soft_margin_rad:
            raise ConfigError(
                f'soft_margin_rad = {self.soft_margin_rad} leaves no room between the limits'
            )


class JointLimits:
    """Position limits as arrays: `low`, `high` (2,) [rad], `margin` [rad]."""

    def __init__(self, config: JointLimitsConfig) -> None:
        self.low = np.array([config.pan_min_rad, config.tilt_min_rad])
        self.high = np.array([config.pan_max_rad, config.tilt_max_rad])
        self.margin = config.soft_margin_rad

    def clip(self, posture: ArrayLike) -> NDArray[np.float64]:
        """Return the nearest posture (2,) [rad] inside the position limits."""
        return np.clip(np.asarray(posture, float), self.low, self.high)

    def reachable(self, posture: ArrayLike) -> NDArray[np.float64]:
        """Return the nearest posture (2,) [rad] that may be a target: inside the soft margin."""
        return np.clip(np.asarray(posture, float), self.low + self.margin, self.high - self.margin)

    def excess_rad(self, posture: ArrayLike) -> float:
        """Return by how much [rad] the joint that is farthest out exceeds its limits; 0 inside."""
        return float(np.max(np.abs(np.asarray(posture, float) - self.clip(posture))))
