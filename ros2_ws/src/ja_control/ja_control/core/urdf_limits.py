"""Joint limits of the two joints of the head from a URDF (`robot_description`)."""

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_control.core.joint_limits import JointLimitsConfig

# Within this of the axis that REP-103 gives to pan (up) or tilt (left).
_AXIS_TOLERANCE = math.cos(math.radians(15.0))


LARGEST_URDF = 2**24
"""Characters of a robot description that is read; those with meshes have some thousand."""


class _WithoutDoctype(ElementTree.TreeBuilder):
    """A builder that refuses a document type: its entities can expand to more than the memory."""

    def doctype(self, name: str, _pubid: str | None, _system: str | None) -> None:
        raise ValueError(f'the robot description has a DOCTYPE ({name[:50]}): remove it')


@dataclass(frozen=True)
class UrdfJoint:
    """One joint: limits [rad, rad/s] as the rig counts, and its axis (3,) in the root's frame.

    Infinite limits stand for a joint that is `continuous`.
    """

    low: float
    high: float
    max_speed: float
    axis: NDArray[np.float64]


def read_joint(urdf: str, name: str) -> UrdfJoint:
    """Return one joint of a URDF, all joints at zero.

    Raises ValueError with what is missing or wrong.
    """
    if len(urdf) > LARGEST_URDF:
        raise ValueError(f'the robot description is longer than {LARGEST_URDF} characters')
    try:
        robot = ElementTree.fromstring(urdf, ElementTree.XMLParser(target=_WithoutDoctype()))
    except ElementTree.ParseError as error:
        raise ValueError(f'the robot description is no XML: {error}') from None
    joints = {joint.get('name', ''): joint for joint in robot.findall('joint')}
    if name not in joints:
        raise ValueError(f'the robot description has no joint {name!r}; it has {sorted(joints)}')
    joint = joints[name]
    kind = joint.get('type')
    if kind not in ('revolute', 'continuous'):
        raise ValueError(f'joint {name} of the robot description is {kind}, not revolute')
    axis = _numbers(joint.find('axis'), 'xyz', '1 0 0')
    turned = _rotation_to_root(joint, joints) @ axis
    limit = joint.find('limit')
    low, high = -math.inf, math.inf
    if kind == 'revolute':
        low, high = _number(limit, 'lower', name, 0.0), _number(limit, 'upper', name, 0.0)
    speed = _number(limit, 'velocity', name, math.inf)
    if not low < high or not speed > 0.0:
        raise ValueError(f'joint {name} cannot move from {low:g} to {high:g} at {speed:g} rad/s')
    return UrdfJoint(low, high, speed, turned / max(float(np.linalg.norm(turned)), 1e-12))


def narrow_limits(
    limits: JointLimitsConfig, pan: UrdfJoint, tilt: UrdfJoint, signs: NDArray, offsets: NDArray
) -> JointLimitsConfig:
    """Return the narrower of the limits and those of a URDF.

    `signs` and `offsets` (2,) [rad] are the rig's: rig angle = sign * angle + offset. Raises
    ValueError when an axis of the URDF contradicts the sign, or nothing is left between limits.
    """
    ranges = []
    for what, joint, sign, offset, rep_103 in (
        ('pan', pan, signs[0], offsets[0], (0.0, 0.0, 1.0)),
        ('tilt', tilt, signs[1], offsets[1], (0.0, 1.0, 0.0)),
    ):
        along = float(sign * joint.axis @ np.array(rep_103))
        if not along >= _AXIS_TOLERANCE:
            opposite = along < -_AXIS_TOLERANCE
            remedy = f'change {what}_inverted on every node' if opposite else f'not {rep_103}'
            raise ValueError(
                f'the URDF turns {what} about {joint.axis.round(2).tolist()}, '
                f'against its parameters: {remedy}'
            )
        ends = sorted((sign * (joint.low - offset), sign * (joint.high - offset)))
        ranges.append(ends)
    (pan_low, pan_high), (tilt_low, tilt_high) = ranges
    speeds = (limits.max_speed_rad_s, pan.max_speed, tilt.max_speed)
    try:
        return replace(
            limits,
            # Not Python's max and min, for which NaN would be no limit.
            pan_min_rad=float(np.maximum(limits.pan_min_rad, pan_low)),
            pan_max_rad=float(np.minimum(limits.pan_max_rad, pan_high)),
            tilt_min_rad=float(np.maximum(limits.tilt_min_rad, tilt_low)),
            tilt_max_rad=float(np.minimum(limits.tilt_max_rad, tilt_high)),
            max_speed_rad_s=float(np.min(speeds)),
        )
    except ConfigError as error:
        raise ValueError(f'limits of the URDF and of the parameters: {error}') from None


def _rotation_to_root(
    joint: ElementTree.Element, joints: dict[str, ElementTree.Element]
) -> NDArray[np.float64]:
    """Rotation (3, 3) from the joint's frame to the root link's."""
    by_child = {_link(j, 'child'): j for j in joints.values()}
    rotation = np.eye(3)
    current: ElementTree.Element | None = joint
    for _ in range(len(joints)):
        if current is None:
            return rotation
        rotation = _rpy(_numbers(current.find('origin'), 'rpy', '0 0 0')) @ rotation
        current = by_child.get(_link(current, 'parent'))
    if current is not None:
        raise ValueError('the joints of the robot description form a loop')
    return rotation


def _link(joint: ElementTree.Element, role: str) -> str:
    element = joint.find(role)
    return '' if element is None else element.get('link', '')


def _rpy(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation (3, 3) about the fixed axes x, y, z, as in URDF."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _numbers(
    element: ElementTree.Element | None, attribute: str, default: str
) -> NDArray[np.float64]:
    text = default if element is None else element.get(attribute, default)
    try:
        numbers = np.array([float(word) for word in text.split()])
    except ValueError:
        numbers = np.empty(0)
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise ValueError(f'{attribute}="{text[:40]}" of the robot description is not 3 numbers')
    return numbers


def _number(
    element: ElementTree.Element | None, attribute: str, joint: str, default: float
) -> float:
    text = None if element is None else element.get(attribute)
    if text is None:
        return default
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f'joint {joint}: {attribute}="{text[:40]}" is no number')
    return number
