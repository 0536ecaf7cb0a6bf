"""All limits that a description states of a joint: the narrowest hold, and each has its source."""

import math

import pytest

from ja_control.core.urdf_joint import read_joint

LIMIT = '<limit lower="-1.2" upper="1.2" velocity="2" effort="1"/>'


def urdf(inside=LIMIT, kind='revolute', outside='', name='pan'):
    return f"""<?xml version="1.0"?><!-- head -->
    <robot name="head" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="a"/><link name="b"/>
    <joint name="{name}" type="{kind}"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
    {inside}</joint>{outside}</robot>"""


def ros2_control(interfaces, attributes='', count=1):
    joint = f'<joint name="pan" {attributes}>{interfaces}</joint>'
    wheel = '<joint name="wheel"><param name="mimic">other</param></joint>'
    return f'<ros2_control name="x" type="system">{wheel}{joint}</ros2_control>' * count


def interface(name='position', kind='command_interface', **bounds):
    params = ''.join(f'<param name="{key}">{text}</param>' for key, text in bounds.items())
    return f'<{kind} name="{name}">{params}</{kind}>'


def soft(lower, upper):
    ends = f'soft_lower_limit="{lower}" soft_upper_limit="{upper}"'
    return f'<safety_controller {ends} k_velocity="1"/>'


def test_the_narrowest_of_all_that_is_stated_holds_end_by_end():
    text = urdf(
        LIMIT + soft(-0.9, 1.1),
        outside=ros2_control(
            interface(min=-1.0, max=0.8)
            + interface('velocity', min=-0.7, max=1.5)
            + interface('acceleration', max=9)
            + interface(kind='state_interface', min=-2, max=0.7)
        ),
    )
    joint = read_joint(text, 'pan')
    assert joint.low == (-0.9, '<safety_controller> of pan')
    assert joint.high == (0.7, '<state_interface> of pan')
    assert joint.max_speed == (0.7, '<command_interface> of pan')
    assert joint.max_acceleration == (9.0, '<command_interface> of pan')
    assert joint.notes == ()


@pytest.mark.parametrize('count', [1, 2])
def test_a_continuous_joint_has_the_limits_that_ros2_control_states(count):
    outside = ros2_control(interface('pan_controller/position', min=-0.5), count=count)
    joint = read_joint(urdf('', 'continuous', outside), 'pan')
    assert (joint.low.value, joint.high.value) == (-0.5, math.inf)
    assert joint.max_speed.value == math.inf


@pytest.mark.parametrize(
    'inside',
    [
        '',
        '<limit effort="1"/>',
        '<limit lower="0" upper="0"/>',
        '<limit lower="-1e16" upper="1e16"/>',
    ],
)
def test_a_continuous_joint_without_limits_turns_all_round(inside):
    joint = read_joint(urdf(inside, 'continuous'), 'pan')
    assert (joint.low.value, joint.high.value) == (-math.inf, math.inf)


def test_an_end_that_is_not_stated_is_zero_as_urdf_has_it():
    joint = read_joint(urdf('<limit upper="1.0" velocity="1"/>'), 'pan')
    assert (joint.low.value, joint.high.value) == (0.0, 1.0)


@pytest.mark.parametrize('rate', ['velocity="0"', 'velocity="0.0"', 'acceleration="0"'])
def test_a_rate_of_zero_is_not_stated_and_this_is_said(rate):
    joint = read_joint(urdf(f'<limit lower="-1" upper="1" effort="0" {rate}/>'), 'pan')
    assert joint.max_speed.value == joint.max_acceleration.value == math.inf
    assert joint.notes == (
        f'joint pan: {rate[: rate.index("=")]} 0 of <limit> is taken as not stated',
    )


def test_soft_limits_of_zero_are_not_stated_and_this_is_said():
    joint = read_joint(urdf(LIMIT + soft(0, 0)), 'pan')
    assert joint.high.value == 1.2
    assert joint.notes == ('joint pan: <safety_controller> from 0 to 0 is taken as not stated',)


def test_rates_of_newer_urdf_versions_are_obeyed_or_named():
    text = urdf('<limit lower="-1" upper="1" acceleration="5" deceleration="-4" jerk="9"/>')
    joint = read_joint(text, 'pan')
    assert joint.max_acceleration.value == 4.0
    assert joint.notes == ('joint pan: jerk of <limit> is not obeyed',)


@pytest.mark.parametrize(
    ('text', 'complaint'),
    [
        (urdf(''), 'is revolute and has no <limit>: state lower and upper'),
        (urdf('<limit effort="1" velocity="1"/>'), 'a <limit> without lower and upper'),
        (urdf('<limit lower="0" upper="0" velocity="0"/>'), 'where an exporter filled in zeros'),
        (urdf(LIMIT + '<mimic joint="lift" multiplier="2"/>'), r'pan follows lift \(mimic\)'),
        (urdf(outside=ros2_control('', 'mimic="true"')), r'follows another joint \(mimic\)'),
        (urdf(outside=ros2_control('<param name="mimic">lift</param>')), 'follows lift'),
        (
            urdf('<limit lower="-60" upper="60" velocity="1"/>'),
            '-60 of <limit> is more than a turn',
        ),
        (urdf(outside=ros2_control(interface(max=90))), '90 of <command_interface> is more than'),
        (urdf(LIMIT + soft('x', 1)), 'lower limit of <safety_controller> is no number: "x"'),
        (urdf(LIMIT + soft(1.3, 2)), r'from 1.3 \(<safety_controller> of pan\) to 1.2'),
        (
            urdf(outside=ros2_control(interface(min=''))),
            'lower limit of <command_interface> is no',
        ),
        (urdf('<limit lower="${-pi/3}" upper="1"/>'), 'xacro has not expanded: run xacro'),
        (urdf('<limit lower="$(arg low)" upper="1"/>'), 'xacro has not expanded: run xacro'),
        (urdf(name='${prefix}pan'), r'the name of a joint .* xacro has not expanded'),
        (
            urdf(outside='<xacro:head prefix="x"/>'),
            r'xacro that was not expanded \(<xacro:head>\)',
        ),
        (urdf(outside=urdf()[urdf().index('<joint') : -8]), "has 2 joints 'pan': rename"),
        (urdf(name='head_pan'), r"no joint 'pan'; it has \['head_pan'\]: set pan_joint"),
        (urdf(kind='prismatic'), 'is prismatic, not revolute'),
        ('<sdf version="1.7"/>', 'is no URDF: it is a <sdf>'),
    ],
)
def test_what_cannot_be_obeyed_is_refused_with_its_cause(text, complaint):
    with pytest.raises(ValueError, match=complaint) as refused:
        read_joint(text, 'pan')
    assert '\n' not in str(refused.value)


def test_a_joint_that_another_one_follows_has_a_motor():
    other = '<joint name="cover" type="revolute"><mimic joint="pan"/></joint>'
    assert read_joint(urdf(outside=other), 'pan').high.value == 1.2


def test_a_joint_that_ros2_control_drives_by_itself_is_no_mimic():
    text = urdf(outside=ros2_control(interface(max=1), 'mimic="false"'))
    assert read_joint(text, 'pan').high.value == 1.0
