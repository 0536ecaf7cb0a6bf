"""The narrower of the gate's limits and of those of a robot description."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_control.core.joint_limits import JointLimitsConfig
from ja_control.core.urdf_joint import Bound, UrdfJoint

# Within this of the axis that REP-103 gives to pan (up) or tilt (left).
_AXIS_TOLERANCE = math.cos(math.radians(15.0))


@dataclass(frozen=True)
class NarrowedLimits:
    """The limits that hold, what states each of them, and what a person should know."""

    config: JointLimitsConfig
    sources: str
    notes: tuple[str, ...]


def narrow_limits(
    limits: JointLimitsConfig, pan: UrdfJoint, tilt: UrdfJoint, signs: NDArray, offsets: NDArray
) -> NarrowedLimits:
    """Return the narrowest of the limits and of those of a URDF.

    `signs` and `offsets` (2,) [rad] are the rig's: rig angle = sign * angle + offset. Raises
    ValueError when an axis of the URDF contradicts the sign, or nothing is left between limits.
    """
    pan_low, pan_high = _ends('pan', pan, signs[0], offsets[0], (0.0, 0.0, 1.0))
    tilt_low, tilt_high = _ends('tilt', tilt, signs[1], offsets[1], (0.0, 1.0, 0.0))
    bounds = {
        'pan_min_rad': max(_own(limits, 'pan_min_rad'), pan_low),
        'pan_max_rad': min(_own(limits, 'pan_max_rad'), pan_high),
        'tilt_min_rad': max(_own(limits, 'tilt_min_rad'), tilt_low),
        'tilt_max_rad': min(_own(limits, 'tilt_max_rad'), tilt_high),
        'max_speed_rad_s': min(_own(limits, 'max_speed_rad_s'), pan.max_speed, tilt.max_speed),
        'max_acceleration_rad_s2': min(
            _own(limits, 'max_acceleration_rad_s2'), pan.max_acceleration, tilt.max_acceleration
        ),
    }
    sources = ', '.join(f'{name} {b.value:.4g} ({b.source})' for name, b in bounds.items())
    try:
        config = replace(limits, **{name: bound.value for name, bound in bounds.items()})
    except ConfigError as error:
        text = f'limits of the URDF and of the parameters: {error}; they are {sources}'
        raise ValueError(text) from None
    return NarrowedLimits(config, sources, pan.notes + tilt.notes)


def _own(limits: JointLimitsConfig, name: str) -> Bound:
    return Bound(getattr(limits, name), 'parameter')


def _ends(
    what: str, joint: UrdfJoint, sign: float, offset: float, rep_103: tuple[float, float, float]
) -> tuple[Bound, Bound]:
    """Return both ends of a joint as we count, once its axis agrees with the sign."""
    along = float(sign * joint.axis @ np.array(rep_103))
    if not along >= _AXIS_TOLERANCE:
        opposite = along < -_AXIS_TOLERANCE
        remedy = f'change {what}_inverted on every node' if opposite else f'not {rep_103}'
        raise ValueError(
            f'the URDF turns {what} about {joint.axis.round(2).tolist()}, '
            f'against its parameters: {remedy}'
        )
    low, high = (
        end._replace(value=float(sign * (end.value - offset))) for end in (joint.low, joint.high)
    )
    return (low, high) if sign > 0.0 else (high, low)
