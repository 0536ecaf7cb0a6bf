"""The pan-tilt head: what an ideal one reaches, and how a hobby servo falls short."""

from dataclasses import replace

import numpy as np
import pytest

from ja_sim.core.head import PanTiltHead
from ja_sim.core.specs import HEAD_PRESETS, HeadSpec

RNG = np.random.default_rng(0)


def trace(head: PanTiltHead, target: list[float], duration_s: float = 1.0) -> np.ndarray:
    """Return the true posture every millisecond after a command, (T, 2) [rad]."""
    start_s = head.time_s
    head.command(np.array(target))
    postures = []
    for step in range(1, round(duration_s * 1000) + 1):
        head.advance_to(start_s + step / 1000)
        postures.append(head.posture)
    return np.array(postures)


def test_ideal_head_reaches_any_posture_within_a_step():
    head = PanTiltHead(HEAD_PRESETS['ideal'])
    for corner in (head.limits[:, 0], head.limits[:, 1]):
        path = trace(head, corner.tolist(), 0.1)
        np.testing.assert_allclose(path[-1], corner, atol=1e-3)
        assert np.all(np.abs(head.velocity) < np.radians(10.0))


def test_ideal_encoders_tell_the_truth():
    head = PanTiltHead(HEAD_PRESETS['ideal'])
    trace(head, [0.4, -0.2])
    sample = head.read_encoders(123, RNG)
    assert sample.stamp_ns == 123
    np.testing.assert_allclose(sample.position, head.posture, atol=1e-6)
    np.testing.assert_allclose(sample.velocity, [0.0, 0.0], atol=1e-4)


def test_commands_beyond_the_limits_are_clamped_and_told():
    head = PanTiltHead(HeadSpec(pan_limit_deg=30.0, tilt_limit_deg=10.0))
    assert head.command(np.radians([40.0, 0.0]))
    assert not head.command(np.radians([29.0, -9.0]))
    path = trace(head, np.radians([90.0, -90.0]).tolist(), 0.3)
    np.testing.assert_allclose(np.degrees(path[-1]), [30.0, -10.0], atol=0.01)


@pytest.mark.parametrize('speed_deg_s', [100.0, 400.0])
def test_no_servo_turns_faster_than_its_motor(speed_deg_s):
    spec = HeadSpec(speed_limit_deg_s=speed_deg_s, acceleration_limit_deg_s2=20000.0)
    path = np.degrees(trace(PanTiltHead(spec), [1.0, 0.5]))
    speed = np.abs(np.diff(path, axis=0)) / 0.001
    assert 0.6 * speed_deg_s < speed[:, 0].max() < 1.001 * speed_deg_s


def test_acceleration_is_limited():
    spec = HeadSpec(acceleration_limit_deg_s2=3000.0)
    path = np.degrees(trace(PanTiltHead(spec), [0.5, 0.0]))
    acceleration = np.diff(path[:, 0], n=2) / 0.001**2
    assert np.abs(acceleration).max() < 1.02 * 3000.0


def test_nothing_moves_during_the_dead_time():
    path = trace(PanTiltHead(HeadSpec(dead_time_s=0.05)), [0.3, 0.0])
    assert np.all(np.abs(path[:49, 0]) < 1e-6)
    assert path[60, 0] > 0.01


def test_backlash_leaves_the_camera_to_one_side_or_the_other():
    head = PanTiltHead(HeadSpec(backlash_deg=2.0))
    ends = []
    for start in (0.5, -0.5):
        trace(head, [start, 0.0])
        ends.append(np.degrees(trace(head, [0.0, 0.0])[-1, 0]))
        # The encoder sits on the motor: it does not see the play.
        assert abs(np.degrees(head.read_encoders(0, RNG).position[0])) < 0.1
    # The load coasts through the play: where it rests depends on where it came from.
    assert ends == pytest.approx([-1.0, 1.0], abs=0.1)


def test_encoder_noise_and_resolution():
    head = PanTiltHead(HeadSpec(encoder_noise_deg=0.5))
    readings = np.degrees([head.read_encoders(0, RNG).position for _ in range(2000)])
    assert readings.std(axis=0) == pytest.approx(0.5, rel=0.1)
    head = PanTiltHead(HeadSpec(encoder_step_deg=0.4))
    trace(head, np.radians([10.1, -3.3]).tolist())
    reading = np.degrees(head.read_encoders(0, RNG).position)
    np.testing.assert_allclose(reading, [10.0, -3.2], atol=1e-6)


def test_delayed_encoders_tell_where_the_head_was():
    head = PanTiltHead(HeadSpec(encoder_delay_s=0.02, servo_frequency_rad_s=20.0))
    path = trace(head, [0.5, 0.2], 0.1)
    np.testing.assert_allclose(head.read_encoders(0, RNG).position, path[-21], atol=2e-3)
    assert np.abs(path[-1] - path[-21]).min() > 0.01


def test_hobby_servo_arrives_within_its_play():
    head = PanTiltHead(HEAD_PRESETS['hobby_servo'])
    for target in ([0.6, 0.2], [-0.3, -0.1]):
        error = np.degrees(trace(head, target)[-1] - target)
        assert np.all(np.abs(error) < HEAD_PRESETS['hobby_servo'].backlash_deg)


def test_reset_stands_still_in_the_middle():
    head = PanTiltHead(replace(HEAD_PRESETS['hobby_servo'], encoder_noise_deg=0.0))
    trace(head, [0.5, 0.2], 0.1)
    head.reset()
    np.testing.assert_array_equal(head.posture, [0.0, 0.0])
    assert np.abs(trace(head, [0.0, 0.0], 0.2)).max() < 1e-6
