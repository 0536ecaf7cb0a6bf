"""The frames of the head, and the robot description (URDF) of a head with ideal axes."""

import math
import xml.etree.ElementTree as ElementTree
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ja_common.joint_codec import JointCodec, JointConfig

BASE_FRAME = 'base_link'
"""The frame in which the head stands: x forward at pan 0, the camera in its origin."""
CAMERA_FRAME = 'camera_optical_frame'
WIDE_FRAME = 'wide_optical_frame'
"""The camera that stands still beside the base and in whose picture the digital head looks."""
PAN_TILT_URDF = Path(str(files('ja_common'))) / 'urdf' / 'pan_tilt.urdf'

_OPTICAL_RPY = f'{-math.pi / 2!r} 0 {-math.pi / 2!r}'


def describe_head(
    joints: JointConfig,
    limits: ArrayLike | None = None,
    max_speed: float | None = None,
    wide_camera: bool = False,
) -> str:
    """Return `pan_tilt.urdf` with the names, signs and offsets of the rig's joints.

    `limits` (2, 2) [rad]: lower and upper end of pan and of tilt, in REP-103 axes; `max_speed`
    [rad/s] of both joints. None: as in the file. `wide_camera`: with the frame `WIDE_FRAME`.
    """
    robot = ElementTree.fromstring(PAN_TILT_URDF.read_text(encoding='utf-8'))
    codec = JointCodec(joints)
    for index, joint in enumerate(robot.findall('joint')[:2]):
        sign, offset = codec.signs[index], codec.offsets[index]
        joint.set('name', codec.names[index])
        # At the rig's zero the head is turned by what the rig reads when it looks ahead.
        axis = np.eye(3)[(2, 1)[index]]
        _child(joint, 'origin').set('rpy', _numbers(-sign * offset * axis))
        _child(joint, 'axis').set('xyz', _numbers(sign * axis))
        limit = _child(joint, 'limit')
        ends = np.array(
            [float(limit.get(end, '')) for end in ('lower', 'upper')]
            if limits is None
            else np.asarray(limits, float)[index]
        )
        for end, value in zip(('lower', 'upper'), sorted(sign * ends + offset), strict=True):
            limit.set(end, _numbers([value]))
        if max_speed is not None:
            limit.set('velocity', _numbers([max_speed]))
    if wide_camera:
        _add_wide_camera(robot)
    return ElementTree.tostring(robot, encoding='unicode')


def _add_wide_camera(robot: ElementTree.Element) -> None:
    ElementTree.SubElement(robot, 'link', name=WIDE_FRAME)
    joint = ElementTree.SubElement(robot, 'joint', name='wide_optical', type='fixed')
    ElementTree.SubElement(joint, 'parent', link=BASE_FRAME)
    ElementTree.SubElement(joint, 'child', link=WIDE_FRAME)
    ElementTree.SubElement(joint, 'origin', xyz='0 0 0', rpy=_OPTICAL_RPY)


def _child(joint: ElementTree.Element, tag: str) -> ElementTree.Element:
    found = joint.find(tag)
    assert found is not None
    return found


def _numbers(values: ArrayLike) -> str:
    # Adding zero removes the sign of a negative one.
    return ' '.join(repr(float(value) + 0.0) for value in np.asarray(values))
