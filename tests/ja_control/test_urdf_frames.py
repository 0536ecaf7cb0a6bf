"""Forward kinematics of a URDF, and what cannot be one."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ja_common.core.geometry import head_rotation, vectors_of_rays
from ja_common.head_description import (
    BASE_FRAME,
    CAMERA_FRAME,
    PAN_TILT_URDF,
    WIDE_FRAME,
    describe_head,
)
from ja_common.joint_codec import JointCodec, JointConfig
from ja_control.core.urdf_frames import FrameTree

POSTURES = np.random.default_rng(3).uniform(-1.5, 1.5, (20, 2))
CROSSED = """<robot name="r">
  <link name="base"/><link name="arm"/><link name="slide"/><link name="hand"/><link name="side"/>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="slide"/>
    <origin xyz="0 0 1"/><axis xyz="0 0 2"/></joint>
  <joint name="elbow" type="continuous"><parent link="slide"/><child link="arm"/>
    <origin xyz="0.5 0 0" rpy="0.1 -0.2 0.3"/><axis xyz="0 1 0"/></joint>
  <joint name="wrist" type="revolute"><parent link="arm"/><child link="hand"/>
    <mimic joint="elbow" multiplier="-2" offset="0.1"/></joint>
  <joint name="fin" type="revolute"><parent link="base"/><child link="side"/>
    <axis xyz="0 0 1"/><mimic joint="wrist"/></joint>
</robot>"""


def joint(text, kind='fixed', parent='a', child='b', name='j'):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'{text}</joint>'
    )


def robot(*parts, links='ab'):
    return f'<robot>{"".join(f"<link name={link!r}/>" for link in links)}{"".join(parts)}</robot>'


@pytest.mark.parametrize('posture', POSTURES)
def test_the_shipped_head_turns_as_the_geometry_of_the_graph(posture):
    tree = FrameTree(PAN_TILT_URDF.read_text())
    assert tree.root == BASE_FRAME
    assert tree.joints_between(CAMERA_FRAME, BASE_FRAME) == {'pan', 'tilt'}
    positions = dict(zip(('pan', 'tilt'), posture, strict=True))
    head = tree.pose('camera_link', BASE_FRAME, positions)
    assert np.allclose(head.rotation, head_rotation(posture), rtol=0.0, atol=1e-9)
    optical = tree.pose(CAMERA_FRAME, BASE_FRAME, positions)
    assert np.allclose(optical.position, 0.0)
    ray = np.array([0.2, -0.1])
    seen = optical.rotation @ [*ray, 1.0]
    assert np.allclose(seen, vectors_of_rays(posture, ray), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize('pan_inverted', [False, True])
@pytest.mark.parametrize('tilt_inverted', [False, True])
def test_a_rig_with_other_signs_and_offsets_turns_alike(pan_inverted, tilt_inverted):
    """The URDF counts as the rig, the graph in REP-103 axes."""
    config = JointConfig(
        'a', 'b', pan_inverted, tilt_inverted, pan_offset_rad=0.7, tilt_offset_rad=-0.2
    )
    codec, tree = JointCodec(config), FrameTree(describe_head(config, wide_camera=True))
    for posture in POSTURES:
        rig = codec.signs * posture + codec.offsets
        positions = dict(zip(codec.names, rig, strict=True))
        found = tree.pose('camera_link', BASE_FRAME, positions).rotation
        assert np.allclose(found, head_rotation(posture), rtol=0.0, atol=1e-9)
    ahead = tree.pose(WIDE_FRAME, BASE_FRAME, {}).rotation
    assert np.allclose(ahead, tree.pose(CAMERA_FRAME, 'camera_link', {}).rotation)


def test_sliding_turning_and_following_joints():
    tree = FrameTree(CROSSED)
    positions = {'lift': 0.25, 'elbow': 0.4}
    arm = tree.pose('arm', 'base', positions)
    assert np.allclose(arm.position, [0.5, 0.0, 1.25])  # the axis has length 1
    turned = Rotation.from_euler('xyz', [0.1, -0.2, 0.3]) * Rotation.from_euler('y', 0.4)
    assert np.allclose(arm.rotation, turned.as_matrix())
    hand = tree.pose('hand', 'arm', positions)
    assert np.allclose(hand.rotation, Rotation.from_euler('x', -0.7).as_matrix())
    side = tree.pose('side', 'base', positions)
    assert np.allclose(side.rotation, Rotation.from_euler('z', -0.7).as_matrix())
    assert tree.joints_between('hand', 'arm') == {'elbow'}
    assert tree.joints_between('hand', 'base') == {'lift', 'elbow'}
    assert tree.joints_between('base', 'base') == set()
    assert {each.name for each in tree.moving_joints({'elbow': 0.0})} == {'elbow', 'wrist', 'fin'}


def test_poses_are_inverse_and_compose():
    tree, positions = FrameTree(CROSSED), {'lift': 0.25, 'elbow': 0.4}
    there, back = tree.pose('hand', 'side', positions), tree.pose('side', 'hand', positions)
    whole = there.after(back)
    assert np.allclose(whole.rotation, np.eye(3))
    assert np.allclose(whole.position, 0.0)


@pytest.mark.parametrize(
    ('urdf', 'complaint'),
    [
        ('<robot/>', 'no <link>'),
        ('<html/>', 'is no URDF'),
        ('not xml', 'is no XML'),
        (robot(), 'links without a parent'),
        (robot(links='aa'), "several links ['a']"),
        (robot(joint(''), joint('')), "several joints ['j']"),
        (robot(joint(''), joint('', name='k')), 'hangs on'),
        (robot(joint('', child='c')), "child 'c', which is no link"),
        (robot(joint('', parent='')), "parent '', which is no link"),
        (robot(joint(''), joint('', parent='b', child='a', name='k')), 'form a loop'),
        (robot(joint('', 'floating')), 'is floating'),
        (robot(joint('', '')), 'without a type'),
        (robot(joint('', name='')), 'has no name'),
        (robot(joint('<axis xyz="0 0 0"/>', 'revolute')), 'is 0 0 0'),
        (robot(joint('<axis xyz="0 one 0"/>', 'revolute')), 'not 3 numbers'),
        (robot(joint('<origin xyz="0 0 ${x}"/>')), 'xacro'),
        (robot(joint('<mimic joint="k"/>', 'revolute')), "follows 'k'"),
        (robot(joint('<mimic joint="j"/>', 'revolute')), 'follows itself'),
        (robot(joint('<mimic joint="j" offset="nan"/>', 'revolute')), 'offset of <mimic>'),
        (
            robot(joint(''), joint('', parent='d', child='c', name='k'),
                  joint('', parent='c', child='d', name='l'), links='abcd'),
            'form a loop',
        ),
    ],
)  # fmt: skip
def test_what_is_no_tree_of_frames_is_refused_in_one_sentence(urdf, complaint):
    with pytest.raises(ValueError, match='robot description') as caught:
        FrameTree(urdf)
    assert complaint in str(caught.value)
    assert '\n' not in str(caught.value)


def test_an_unknown_link_is_named_with_those_that_exist():
    tree = FrameTree(PAN_TILT_URDF.read_text())
    with pytest.raises(ValueError, match=r"no link 'eye'.*base_link.*set base_frame"):
        tree.pose('eye', BASE_FRAME, {})
    with pytest.raises(KeyError):
        tree.pose(CAMERA_FRAME, BASE_FRAME, {'pan': 0.0})
