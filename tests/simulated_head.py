"""A simulated head that is led through a calibration, without ROS.

Servos, play and encoders are the sim's. Its camera sees a wall far away, drawn by a warp, in a
hundredth of the time of the sim's room; `picture_of` may be that room instead.
"""

import math
from collections import deque
from collections.abc import Callable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_calibration.core.calibration_moves import Calibration, CalibrationConfig, calibration_moves
from ja_calibration.core.calibration_sequence import CalibrationSequence
from ja_common.core.geometry import head_rotation
from ja_common.core.posture import PostureHistory
from ja_control.core.motion_profile import MotionProfile
from ja_sim.core.head import PanTiltHead
from ja_sim.core.specs import HeadSpec

PERIOD_S = 0.01
PERIODS_AN_IMAGE = 7
ACCELERATION_RAD_S2 = 1.5
WIDTH, HEIGHT = 320, 240
# From the head's axes to the optical ones.
_OPTICAL = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])


def focal_lengths(head: HeadSpec) -> NDArray[np.float64]:
    """Return the true focal lengths, (2,) [px]."""
    view = np.radians([head.view_pan_deg, head.view_tilt_deg])
    return np.array([WIDTH, HEIGHT]) / 2 / np.tan(view)


class Wall:
    """A blurred random pattern at infinity, as a camera sees it from any posture."""

    def __init__(self, head: HeadSpec, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        size = (3 * WIDTH, 3 * HEIGHT)
        # From large patches to small ones, as in any room.
        patterns = [self._rng.uniform(0.0, 85.0, (3 * n, 4 * n)) for n in (4, 12, 36)]
        self._wall = sum(cv2.resize(p, size, interpolation=cv2.INTER_CUBIC) for p in patterns)
        self._noise = head.image_noise
        fx, fy = focal_lengths(head)
        centre_x, centre_y = (WIDTH - 1) / 2, (HEIGHT - 1) / 2
        self._camera = np.array([[fx, 0.0, centre_x], [0.0, fy, centre_y], [0.0, 0.0, 1.0]])
        self._shift = np.array([[1.0, 0.0, -WIDTH], [0.0, 1.0, -HEIGHT], [0.0, 0.0, 1.0]])

    def picture(self, posture: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return the picture (H, W) from a posture (2,) [rad]."""
        turn = _OPTICAL @ head_rotation(posture).T @ _OPTICAL.T
        warp = self._camera @ turn @ np.linalg.inv(self._camera) @ self._shift
        sharp = cv2.warpPerspective(self._wall, warp, (WIDTH, HEIGHT), borderMode=cv2.BORDER_WRAP)
        noise = self._rng.normal(0.0, self._noise, sharp.shape) if self._noise else 0.0
        return np.clip(sharp + noise, 0, 255).round().astype(np.uint8)


def calibrated(
    spec: HeadSpec,
    config: CalibrationConfig,
    signs: Sequence[float] = (1.0, 1.0),
    stamps_late_s: float = 0.0,
    picture_of: Callable[[NDArray[np.float64]], NDArray[np.uint8]] | None = None,
    seed: int = 0,
) -> Calibration:
    """Return the calibration of a head whose joints count by `signs`, with late image stamps.

    Pictures arrive at the time of their stamp, as the joint states do, at 14 per second.
    """
    head, rng = PanTiltHead(spec), np.random.default_rng(seed)
    picture_of = picture_of or Wall(spec, seed).picture
    turns = np.asarray(signs)
    sequence = CalibrationSequence(calibration_moves(config, np.zeros(2)))
    history = PostureHistory()
    pictures: deque[tuple[int, NDArray[np.float64]]] = deque()
    position, profiles, speed = np.zeros(2), list[MotionProfile](), math.nan
    period = 0
    while sequence.result is None:
        period += 1
        if sequence.speed_rad_s != speed:
            speed = sequence.speed_rad_s
            profiles = [
                MotionProfile(PERIOD_S, speed, ACCELERATION_RAD_S2, float(p)) for p in position
            ]
        for profile, aim in zip(profiles, sequence.target, strict=True):
            profile.approach(float(aim))
        position = np.array([profile.position for profile in profiles])
        head.command(position * turns)
        head.advance_to(period * PERIOD_S)
        now_ns = round(period * PERIOD_S * 1e9)
        angles = head.read_encoders(now_ns, rng).position * turns
        history.record_posture(now_ns, angles)
        sequence.record_joints(now_ns, angles)
        if period % PERIODS_AN_IMAGE == 0:
            pictures.append((now_ns + round(stamps_late_s * 1e9), head.posture))
        while pictures and pictures[0][0] <= now_ns:
            stamp_ns, posture = pictures.popleft()
            measured = history.at(stamp_ns)
            if sequence.needs_images and measured is not None:
                sequence.record_image(picture_of(posture), stamp_ns, measured.position)
        sequence.step(now_ns * 1e-9, position, [profile.velocity for profile in profiles])
    return sequence.result
