"""Limits from a URDF: the narrower ones hold; contradictions are refused."""

import numpy as np
import pytest

from ja_control.core.joint_limits import JointLimitsConfig
from ja_control.core.urdf import LARGEST_URDF
from ja_control.core.urdf_joint import read_joint
from ja_control.core.urdf_limits import narrow_limits

PLAIN = (np.ones(2), np.zeros(2))


def urdf(pan='0 0 1', tilt='0 1 0', limits='lower="-0.5" upper="0.9" velocity="1.5"', rpy='0 0 0'):
    return f"""<robot name="head"><link name="base"/><link name="neck"/><link name="eye"/>
    <joint name="pan" type="revolute"><parent link="base"/><child link="neck"/>
    <axis xyz="{pan}"/><limit {limits} effort="1"/></joint>
    <joint name="tilt" type="revolute"><parent link="neck"/><child link="eye"/>
    <origin rpy="{rpy}"/><axis xyz="{tilt}"/><limit {limits} effort="1"/></joint></robot>"""


def limits_of(text, signs=PLAIN[0], offsets=PLAIN[1]):
    joints = [read_joint(text, name) for name in ('pan', 'tilt')]
    return narrow_limits(JointLimitsConfig(), *joints, signs, offsets).config


def test_the_narrower_of_urdf_and_parameters_holds():
    limits = limits_of(urdf())
    assert (limits.pan_min_rad, limits.pan_max_rad) == (-0.5, 0.9)
    assert (limits.tilt_min_rad, limits.tilt_max_rad) == (-0.5, 0.61)
    assert limits.max_speed_rad_s == 1.5


def test_limits_are_turned_with_the_sign_and_moved_with_the_offset_of_the_rig():
    limits = limits_of(urdf(pan='0 0 -1'), np.array([-1.0, 1.0]), np.array([0.1, 0.0]))
    assert (limits.pan_min_rad, limits.pan_max_rad) == pytest.approx((-0.8, 0.6))


def test_axis_is_that_in_the_frame_of_the_root():
    """A tilt joint whose own z axis points to the left."""
    assert limits_of(urdf(tilt='0 0 1', rpy='-1.5707963 0 0')).tilt_min_rad == -0.5


@pytest.mark.parametrize(
    ('text', 'complaint'),
    [
        ('rm -rf', 'is no XML'),
        ('<robot/>', r"no joint 'pan'; it has \[\]"),
        (urdf(pan='0 0 -1'), 'change pan_inverted on every node'),
        (urdf(tilt='1 0 0'), r'turns tilt about \[1.0, 0.0, 0.0\]'),
        (urdf(tilt='0 nan 0'), 'is not 3 numbers'),
        (urdf(limits='lower="x" upper="1"'), 'lower limit of <limit> is no number: "x"'),
        (urdf(limits='lower="nan" upper="1"'), 'lower limit of <limit> is no number: "nan"'),
        (urdf(limits='lower="-1" upper="1" velocity="inf"'), 'velocity of <limit> is no number'),
        (urdf(limits='lower="1" upper="-1" velocity="1"'), 'cannot move from 1'),
        (urdf(limits='lower="2" upper="3" velocity="1"'), 'limits of the URDF and'),
        (urdf().replace('"pan" type="revolute"', '"pan" type="fixed"'), 'fixed, not revolute'),
        (urdf().replace('parent link="base"', 'parent link="eye"'), 'form a loop'),
    ],
)
def test_unusable_urdf_is_refused_in_one_sentence(text, complaint):
    with pytest.raises(ValueError, match=complaint):
        limits_of(text)


LAUGHS = '<!DOCTYPE robot [<!ENTITY a "ha">' + ''.join(
    f'<!ENTITY {chr(98 + n)} "{f"&{chr(97 + n)};" * 10}">' for n in range(9)
)


@pytest.mark.parametrize(
    'text',
    [
        f'{LAUGHS}]><robot>&j;</robot>',
        '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot>&x;</robot>',
        '<!DOCTYPE robot SYSTEM "http://nowhere.invalid/x.dtd"><robot/>',
        '<robot>&x;</robot>',
        '<robot>' * 10**5,
        '<robot>\0</robot>',
        '',
        ' ' * (LARGEST_URDF + 1),
    ],
    ids=lambda text: text[:25],
)
def test_no_description_expands_or_reads_a_file(text):
    with pytest.raises(ValueError, match='the robot description') as refused:
        read_joint(text, 'pan')
    assert '\n' not in str(refused.value)
