"""The posture from joint states as robots publish them: in parts, among others, with gaps."""

import numpy as np
import pytest
from sensor_msgs.msg import JointState

from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.posture_reader import PostureReader
from node_bench import header

MS = 1_000_000


def reader():
    names = {'pan_joint': 'robot1/head_pan', 'tilt_joint': 'robot1/head_tilt'}
    return PostureReader(JointCodec(JointConfig(**names, pan_inverted=True)))


def read(made, *messages):
    """Give a reader messages: (ms, names without prefix, positions, velocities or none)."""
    for ms, names, position, *velocity in messages:
        message = JointState(
            header=header(ms * MS),
            name=[f'robot1/{name}' for name in names],
            position=position,
            velocity=velocity[0] if velocity else [],
        )
        made.record_message(message, ms / 1000)
    return made


def test_pan_and_tilt_in_separate_messages_are_joined_by_name():
    made = read(
        reader(),
        (0, ['head_pan'], [0.0]),
        (5, ['head_tilt'], [0.0]),
        (10, ['left_wheel', 'right_wheel'], [7.0, 7.0], [1.0, 1.0]),
        (20, ['head_pan'], [-0.2]),
        (25, ['head_tilt'], [0.2]),
    )
    posture = made.history.at(15 * MS)
    assert posture.position == pytest.approx((0.15, 0.1))
    assert posture.velocity == pytest.approx((7.5, 5.0)), 'half way from 0 to 10 rad/s'


def test_the_velocity_of_one_joint_is_derived_where_only_that_one_is_of_no_use():
    made = reader()
    for ms in (0, 20):
        names = ['elbow', 'head_tilt', 'head_pan']
        read(made, (ms, names, [0.0, ms / 1000, 0.0], [3.0, np.nan, -2.0]))
    assert made.history.newest.velocity == pytest.approx((2.0, 1.0))


def test_a_position_that_is_no_number_is_refused_and_the_other_joint_is_kept():
    made = read(reader(), (0, ['head_pan', 'head_tilt'], [0.1, 0.1]))
    with pytest.raises(ValueError, match="position of 'robot1/head_pan' is not finite"):
        read(made, (20, ['head_pan', 'head_tilt'], [np.nan, 0.2]))
    assert made.history.newest.stamp_ns == 0
    read(made, (40, ['head_pan'], [0.3]))
    assert made.history.at(20 * MS).position == pytest.approx((-0.2, 0.2))


def test_a_velocity_that_is_only_filled_in_is_named():
    made = reader()
    for ms in range(0, 200, 10):
        read(made, (ms, ['head_pan', 'head_tilt'], [ms / 1000, 0.0], [0.0, 0.0]))
    assert "the velocity of 'robot1/head_pan' is 0 also while" in made.explain_velocity()
    assert made.history.newest.velocity == pytest.approx((-1.0, 0.0))


def test_why_a_posture_is_unknown_names_the_joint():
    made = read(reader(), (0, ['head_pan'], [0.1]), (0, ['head_tilt'], [0.1]))
    read(made, (300, ['head_tilt'], [0.1]))
    assert made.explain_unknown(200 * MS) == (
        "'robot1/head_pan': its newest position is 0.2 s older"
    )
