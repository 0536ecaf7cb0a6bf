"""The last word before the rig: position and speed limits, never silent."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import ConfigError, parameter


@dataclass(frozen=True)
class JointLimitsConfig:
    """Limits of the two joints; the defaults suit the paper's head."""

    pan_min_rad: float = parameter(-1.05, 'rightmost pan', low=-3.15, high=3.15)
    pan_max_rad: float = parameter(1.05, 'leftmost pan', low=-3.15, high=3.15)
    tilt_min_rad: float = parameter(-0.61, 'highest tilt (up is negative)', low=-1.57, high=1.57)
    tilt_max_rad: float = parameter(0.61, 'lowest tilt (down is positive)', low=-1.57, high=1.57)
    max_speed_rad_s: float = parameter(
        2.0, 'fastest change of the commanded posture of each joint', low=0.01, high=50.0
    )

    def __post_init__(self) -> None:
        if self.pan_min_rad >= self.pan_max_rad or self.tilt_min_rad >= self.tilt_max_rad:
            raise ConfigError('each joint needs a lower limit below its upper limit')


@dataclass(frozen=True)
class LimitedCommand:
    """A command inside all limits, and what had to be cut for it ('' when nothing)."""

    posture: NDArray[np.float64]
    clamped: str


class JointLimits:
    """Limits commands relative to the previous one, or to the measured posture after a stop."""

    def __init__(self, config: JointLimitsConfig) -> None:
        self._low = np.array([config.pan_min_rad, config.tilt_min_rad])
        self._high = np.array([config.pan_max_rad, config.tilt_max_rad])
        self._max_speed = config.max_speed_rad_s

    def clip(self, posture: ArrayLike) -> NDArray[np.float64]:
        """The posture (2,) [rad] inside the position limits."""
        return np.clip(np.asarray(posture, float), self._low, self._high)

    def limit(self, target: ArrayLike, previous: ArrayLike, seconds: float) -> LimitedCommand:
        """The command, `seconds` after `previous`, that goes furthest towards `target`.

        All postures (2,) [rad]. Raises ValueError when the target is not finite.
        """
        target = np.asarray(target, float)
        if not np.isfinite(target).all():
            raise ValueError(f'target posture is not finite: {target.tolist()}')
        inside = self.clip(target)
        previous = np.asarray(previous, float)
        reach = self._max_speed * max(seconds, 0.0)
        # The previous posture may lie outside (moved by hand): the way back in is open.
        command = self.clip(previous + np.clip(inside - previous, -reach, reach))
        cut = ['position'] if not np.allclose(inside, target, rtol=0, atol=1e-9) else []
        if not np.allclose(command, inside, rtol=0, atol=1e-9):
            cut.append('speed')
        return LimitedCommand(command, ' and '.join(cut))
