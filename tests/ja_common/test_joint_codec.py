"""JointState: the rig's names and signs outside, (pan, tilt) of REP-103 inside."""

import numpy as np
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

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
    assert message.header.frame_id == 'rig'
    assert codec.decode(message) == pytest.approx((0.1, 0.2))
    assert codec.decode_velocity(message) == pytest.approx((-1.0, 2.0))
    inverted_pan = JointCodec(JointConfig(pan_inverted=True))
    assert inverted_pan.decode(PLAIN.encode(Header(), (0.1, 0.2))) == pytest.approx((-0.1, 0.2))


def test_empty_message_has_no_names():
    message = PLAIN.encode(Header(), None)
    assert not message.name
    assert not message.position
    assert PLAIN.decode(message) is None
    assert PLAIN.decode_velocity(message) is None


@pytest.mark.parametrize('velocity', [[], [np.nan, np.nan]])
def test_rig_that_measures_no_velocity(velocity):
    message = JointState(name=['pan', 'tilt'], position=[0.0, 0.0], velocity=velocity)
    assert PLAIN.decode_velocity(message) is None


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


@pytest.mark.parametrize('velocity', [[0.0], [0.0, np.nan]])
def test_broken_velocity_is_refused(velocity):
    message = JointState(name=['pan', 'tilt'], position=[0.0, 0.0], velocity=velocity)
    with pytest.raises(ValueError, match='velocity'):
        PLAIN.decode_velocity(message)


def test_offset_is_of_postures_and_not_of_changes():
    codec = JointCodec(JointConfig(pan_inverted=True, pan_offset_rad=0.5, tilt_offset_rad=-0.1))
    message = codec.encode_posture(Header(), (0.1, 0.2), velocity=(1.0, 2.0))
    assert list(message.position) == pytest.approx([0.4, 0.1])
    assert list(message.velocity) == pytest.approx([-1.0, 2.0])
    assert codec.decode_posture(message) == pytest.approx((0.1, 0.2))
    assert codec.decode_posture(JointState()) is None
    assert list(codec.encode(Header(), (0.1, 0.2)).position) == pytest.approx([-0.1, 0.2])
