"""The shipped URDF, and what becomes of it for other joints."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from ja_common.head_description import (
    BASE_FRAME,
    CAMERA_FRAME,
    PAN_TILT_URDF,
    WIDE_FRAME,
    describe_head,
)
from ja_common.joint_codec import JointConfig


def limits_of(urdf, joint):
    [limit] = ElementTree.fromstring(urdf).findall(f"joint[@name='{joint}']/limit")
    return [float(limit.get(end)) for end in ('lower', 'upper')]


def links_of(urdf):
    return {link.get('name') for link in ElementTree.fromstring(urdf).findall('link')}


def test_the_shipped_file_has_the_frames_and_the_joints_of_the_graph():
    text = PAN_TILT_URDF.read_text()
    assert {BASE_FRAME, 'pan_link', 'tilt_link', 'camera_link', CAMERA_FRAME} == links_of(text)
    names = [joint.get('name') for joint in ElementTree.fromstring(text).findall('joint')]
    assert names[:2] == [JointConfig().pan_joint, JointConfig().tilt_joint]


def test_without_wishes_it_is_the_shipped_file():
    text = describe_head(JointConfig())
    for joint in ('pan', 'tilt'):
        assert limits_of(text, joint) == limits_of(PAN_TILT_URDF.read_text(), joint)
    assert WIDE_FRAME not in links_of(text)


def test_names_and_limits_are_those_of_the_rig():
    joints = JointConfig(pan_joint='a', tilt_joint='b', tilt_inverted=True, tilt_offset_rad=0.1)
    text = describe_head(joints, [[-1.0, 1.2], [-0.3, 0.5]], 4.0, wide_camera=True)
    assert limits_of(text, 'a') == [-1.0, 1.2]
    assert np.allclose(limits_of(text, 'b'), [-0.4, 0.4])
    velocities = [limit.get('velocity') for limit in ElementTree.fromstring(text).iter('limit')]
    assert velocities == ['4.0', '4.0']
    assert WIDE_FRAME in links_of(text)


@pytest.mark.parametrize('name', ['a "quoted" <name>', 'häd/pan'])
def test_any_name_becomes_xml(name):
    joints = ElementTree.fromstring(describe_head(JointConfig(pan_joint=name))).findall('joint')
    assert joints[0].get('name') == name
