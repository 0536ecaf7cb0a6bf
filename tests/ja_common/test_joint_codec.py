"""JointState: the rig's names and signs outside, (pan, tilt) of REP-103 inside."""

import numpy as np
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ja_common.core.config import ConfigError
from ja_common.joint_codec import JointCodec, JointConfig

PLAIN = JointCodec(JointConfig())


def test_other_joints_and_another_order_do_not_matter():
    message = JointState(name=['wrist', 'tilt', 'pan'], position=[9.0, 0.2, 0.1])
    assert PLAIN.decode(message) == pytest.approx((0.1, 0.2))


def test_rig_with_names_and_signs_of_its_own():
    codec = JointCodec(
        JointConfig(pan_joint='neck_yaw', tilt_joint='neck_pitch', tilt_inverted=True)
    )
    message = codec.encode(Header(frame_id='rig'), (0.1, 0.2), velocity=(-1.0, 2.0))
    assert list(message.name) == ['neck_yaw', 'neck_pitch']
    assert list(message.position) == pytest.approx([0.1, -0.2])
    assert list(message.velocity) == pytest.approx([-1.0, -2.0])
    assert message.header.frame_id == '', 'angles of joints are in no frame'
    assert codec.decode(message) == pytest.approx((0.1, 0.2))
    assert codec.decode_joint(message, 0) == pytest.approx((0.1, -1.0))
    assert codec.decode_joint(message, 1) == pytest.approx((0.2, 2.0))
    inverted_pan = JointCodec(JointConfig(pan_inverted=True))
    assert inverted_pan.decode(PLAIN.encode(Header(), (0.1, 0.2))) == pytest.approx((-0.1, 0.2))


def test_empty_message_has_no_names():
    message = PLAIN.encode(Header(), None)
    assert not message.name
    assert not message.position
    assert PLAIN.decode(message) is None
    assert PLAIN.decode_joint(message, 0) is None


@pytest.mark.parametrize(
    ('names', 'position', 'text'),
    [
        (['pan', 'neck'], [0.0, 0.0], r"no joint \['tilt'\].*it names \['pan', 'neck'\]"),
        (['pan', 'tilt'], [0.0], '1 numbers in position for 2 names'),
        (['pan', 'tilt'], [], '0 numbers in position for 2 names'),
        (['pan', 'tilt'], [0.0, np.nan], 'position .* is not finite'),
        (['pan', 'tilt'], [np.inf, 0.0], 'position .* is not finite'),
    ],
)
def test_broken_message_is_refused(names, position, text):
    with pytest.raises(ValueError, match=text):
        PLAIN.decode(JointState(name=names, position=position))


ROBOT = [f'finger_{i}' for i in range(9)] + ['tilt'] + [f'toe_{i}' for i in range(9)] + ['pan']


@pytest.mark.parametrize(
    ('velocity', 'expected'),
    [
        ([0.5] * 20, 0.5),
        ([], None),
        ([0.5], None),  # of which joint?
        ([np.nan] * 20, None),
        ([0.5] * 9 + [np.nan] + [0.5] * 10, None),  # of this joint alone
        ([np.inf] * 20, None),
        ([np.nan] * 9 + [0.5] + [np.nan] * 10, 0.5),
    ],
)
@pytest.mark.parametrize('effort', [[], [np.nan] * 20, [0.0] * 3])
def test_a_joint_among_twenty_whose_optional_fields_are_of_no_use(velocity, expected, effort):
    position = [9.0] * 9 + [0.2] + [np.nan] * 9 + [0.1]
    message = JointState(name=ROBOT, position=position, velocity=velocity, effort=effort)
    assert PLAIN.decode_joint(message, 1) == (0.2, expected)


@pytest.mark.parametrize(
    'message',
    [
        JointState(),
        JointState(name=['left_wheel', 'tilt'], position=[1.0, 2.0]),
        JointState(name=['left_wheel', 'right_wheel'], velocity=[1.0, 2.0]),
        JointState(name=['left_wheel', 'right_wheel'], position=[np.nan]),
        JointState(name=['pan', 'tilt'], velocity=[1.0, 2.0]),
    ],
    ids=['empty', 'other joints', 'wheels', 'broken wheels', 'only velocities'],
)
def test_a_message_that_states_no_position_of_the_joint_is_foreign(message):
    assert PLAIN.decode_joint(message, 0) is None


@pytest.mark.parametrize(
    ('names', 'position', 'text'),
    [
        (['pan', 'tilt', 'x'], [0.0, 0.0], "2 positions for 3 names: that of 'pan' is unknown"),
        (['pan', 'tilt'], [0.0, 0.0, 0.0], '3 positions for 2 names'),
        (['tilt', 'pan'], [0.0, np.nan], "the position of 'pan' is not finite: nan"),
        (['pan', 'pan'], [0.1, 0.2], r"'pan' is named 2 times, with positions \[0.1, 0.2\]"),
    ],
)
def test_a_position_of_our_joint_that_cannot_be_used_is_refused(names, position, text):
    with pytest.raises(ValueError, match=text):
        PLAIN.decode_joint(JointState(name=names, position=position), 0)


def test_a_joint_named_twice_with_one_position_has_that_position():
    message = JointState(name=['pan', 'tilt', 'pan'], position=[0.1, 0.2, 0.1])
    assert PLAIN.decode_joint(message, 0) == (0.1, None)


def test_a_command_of_one_joint_leaves_the_other():
    last = np.array([0.3, -0.3])
    assert PLAIN.decode_command(JointState(name=['tilt'], position=[0.2]), last) == pytest.approx(
        (0.3, 0.2)
    )
    wheels = JointState(name=['left_wheel'], position=[9.0])
    assert PLAIN.decode_command(wheels, last) == pytest.approx((0.3, -0.3))
    assert last == pytest.approx((0.3, -0.3))


def test_the_two_joints_have_two_names():
    with pytest.raises(ConfigError, match="pan_joint and tilt_joint are both 'neck'"):
        JointConfig(pan_joint='neck', tilt_joint='neck')


def test_offset_is_of_postures_and_not_of_changes():
    codec = JointCodec(JointConfig(pan_inverted=True, pan_offset_rad=0.5, tilt_offset_rad=-0.1))
    message = codec.encode_posture(Header(), (0.1, 0.2), velocity=(1.0, 2.0))
    assert list(message.position) == pytest.approx([0.4, 0.1])
    assert list(message.velocity) == pytest.approx([-1.0, 2.0])
    assert codec.decode_posture(message) == pytest.approx((0.1, 0.2))
    assert codec.decode_posture(JointState()) is None
    assert list(codec.encode(Header(), (0.1, 0.2)).position) == pytest.approx([-0.1, 0.2])
