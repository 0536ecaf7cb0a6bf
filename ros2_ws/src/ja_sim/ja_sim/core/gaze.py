"""How a head and two eyes turn to a point: the kinematics of the caregiver's gaze.

Her rest frame has its origin at the neck joint, x towards the robot, y to her left and z up. Yaw
turns about z (positive to her left), pitch about y (positive down), as pan and tilt do for the
robot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ja_common.core.geometry import directions_of_vectors, head_rotation, vectors_of_directions

EYE_RANGE_RAD = np.radians([40.0, 30.0])  # how far eyes turn in the head: sideways, up and down
HEAD_RANGE_RAD = np.radians([80.0, 50.0])


@dataclass(frozen=True)
class GazePose:
    """A posture of head and eyes in the rest frame.

    ``head`` is (yaw, pitch) [rad]; ``eyes`` is (2, 2): (yaw, pitch) of the left and the right eye
    relative to the head [rad].
    """

    head: np.ndarray
    eyes: np.ndarray


def missed_point(target: np.ndarray, eyes: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return the point (3,) at which eyes look that miss ``target`` by ``error`` (2,) [rad]."""
    centre = eyes.mean(axis=0)
    line = target - centre
    landed = vectors_of_directions(directions_of_vectors(line) + error)
    return centre + np.linalg.norm(line) * landed


def head_angles(target: np.ndarray, eyes: np.ndarray, share: float) -> np.ndarray:
    """Return head yaw and pitch (2,) [rad] for ``share`` of the angle from eyes to target.

    ``target`` (3,) and ``eyes`` (2, 3), left and right at rest, are in the rest frame [m].
    """
    whole = directions_of_vectors(target - eyes.mean(axis=0))
    return np.clip(share * whole, -HEAD_RANGE_RAD, HEAD_RANGE_RAD)


def eye_angles(target: np.ndarray, eyes: np.ndarray, head: np.ndarray) -> np.ndarray:
    """Return yaw and pitch (2, 2) [rad] in the head at which each eye points at the target.

    Clipped to the range of the eyes.
    """
    rotation = head_rotation(head)
    in_head = target @ rotation - eyes
    return np.clip(directions_of_vectors(in_head), -EYE_RANGE_RAD, EYE_RANGE_RAD)


def minimum_jerk(phase: float) -> float:
    """Return smooth progress from 0 to 1 as ``phase`` goes from 0 to 1 (Flash and Hogan 1985)."""
    phase = min(max(phase, 0.0), 1.0)
    return phase**3 * (10.0 - 15.0 * phase + 6.0 * phase**2)


class GazeShift:
    """Turns from the present posture to a target; eyes lead and stay on it while the head turns.

    All points in the rest frame [m], all times in seconds.
    """

    def __init__(self, eyes: np.ndarray, target: np.ndarray) -> None:
        self._eyes = eyes
        self._from = self._to = head_angles(target, eyes, 1.0)
        self._target = self._old_target = target
        self._start_s, self._turn_s = -math.inf, 1.0

    def start(
        self, at_s: float, turn_s: float, target: np.ndarray, share: float, noise: np.ndarray
    ) -> None:
        """Begin to turn to ``target`` at ``at_s`` (a reaction time ahead), for ``turn_s``."""
        self._from = self._head(at_s)
        self._to = head_angles(target, self._eyes, share) + noise
        self._old_target, self._target = self._target, target
        self._start_s, self._turn_s = at_s, turn_s

    def pose(self, now_s: float, target: np.ndarray | None = None) -> GazePose:
        """Return the posture at ``now_s``; ``target`` moves the point that the eyes follow."""
        head = self._head(now_s)
        if now_s < self._start_s:
            point = self._old_target
        else:
            point = self._target if target is None else target
        return GazePose(head, eye_angles(point, self._eyes, head))

    def _head(self, now_s: float) -> np.ndarray:
        if math.isinf(self._start_s):
            return self._to
        progress = minimum_jerk((now_s - self._start_s) / self._turn_s)
        return self._from + progress * (self._to - self._from)
