"""Camera, Eq. 2, guard and a hobby servo in one loop, with 60 ms from exposure to picture.

The cores alone, in simulated time. The exact ray to one target replaces the detector, so that only
the loop is tested.
"""

from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from ja_common.core.geometry import rays_of_directions
from ja_common.core.posture import PostureHistory
from ja_control.core.command_guard import CommandGuard, CommandGuardConfig
from ja_control.core.joint_limits import JointLimitsConfig
from ja_control.core.visual_feedback import visual_feedback
from ja_sim.core.head import PanTiltHead
from ja_sim.core.specs import HEAD_PRESETS

D_TH = np.radians(6.18)  # Eq. 3
CONTROL_S, CAMERA_TICKS, DELAY_S = 0.01, 3, 0.06


def pursue(target, seconds, spec=HEAD_PRESETS['hobby_servo']):
    """Drive the head to target(t) (2,) [rad]; return times (N,) and true postures (N, 2)."""
    head, history = PanTiltHead(spec), PostureHistory()
    guard = CommandGuard(JointLimitsConfig(), CommandGuardConfig(), CONTROL_S)
    rng = np.random.default_rng(0)
    pictures: deque = deque()
    times, postures = [], []
    for tick in range(1, round(seconds / CONTROL_S) + 1):
        now_s = tick * CONTROL_S
        head.advance_to(now_s)
        sample = head.read_encoders(round(now_s * 1e9), rng)
        history.record_posture(sample.stamp_ns, sample.position, sample.velocity)
        guard.record_joints(sample.position, now_s, 0.0)
        if tick % CAMERA_TICKS == 0:
            ray = rays_of_directions(head.posture, np.asarray(target(now_s)))
            pictures.append((now_s, sample.stamp_ns, ray))
        while pictures and pictures[0][0] <= now_s - DELAY_S + 1e-9:
            taken_s, stamp_ns, ray = pictures.popleft()
            guard.record_image(now_s, now_s - taken_s)
            if guard.engaged:
                guard.set_target(history.at(stamp_ns).position + visual_feedback(ray, gain=1.0))
        command = guard.step(now_s)
        if command.position is not None:
            assert command.hold is None
            head.command(command.position)
        times.append(now_s)
        postures.append(head.posture)
    return np.array(times), np.array(postures)


def test_a_shift_of_twenty_degrees_settles_without_overshoot_and_stands_for_a_minute():
    aim = np.radians([20.0, -8.0])
    times, postures = pursue(lambda _: aim, 62.0)
    error = np.hypot(*(postures - aim).T)
    assert error[times > 1.0].max() < D_TH / 3
    overshoot = np.max((postures - aim) * np.sign(aim), axis=0)
    assert np.all(overshoot < np.radians(1.0))
    rest = postures[times > 2.0]
    assert np.all(np.ptp(rest, axis=0) < np.radians(1.5)), 'the play of the gears, no oscillation'


def test_a_moving_object_is_pursued_smoothly():
    def sway(time_s):
        return np.array([0.4 * np.sin(0.8 * time_s), 0.0])

    times, postures = pursue(sway, 12.0)
    steady = times > 2.0
    error = postures[steady] - np.array([sway(t) for t in times[steady]])
    assert np.hypot(*error.T).max() < D_TH
    speed = np.diff(postures[steady, 0]) / CONTROL_S
    assert np.abs(speed).max() < 3 * 0.4 * 0.8, 'no leaps from image to image'


def test_newest_posture_instead_of_that_of_the_image_would_overshoot():
    """The loop shows the error that the interpolation at the stamp prevents."""
    aim = np.radians([20.0, 0.0])
    original = PostureHistory.at
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(PostureHistory, 'at', lambda history, _: history.newest)
        _, wrong = pursue(lambda _: aim, 2.0)
    assert PostureHistory.at is original
    assert (wrong[:, 0] - aim[0]).max() > np.radians(3.0)


def test_more_delay_is_no_instability():
    aim = np.radians([15.0, 5.0])
    slow = replace(HEAD_PRESETS['hobby_servo'], dead_time_s=0.05)
    times, postures = pursue(lambda _: aim, 6.0, slow)
    assert np.hypot(*(postures[times > 2.0] - aim).T).max() < D_TH / 3
