"""What a reading of landmarks offers to a linear map of gaze."""

import numpy as np
from numpy.typing import NDArray

from ja_common.core.face_gaze import FaceGaze
from ja_learning.core.gaze_features import Features
from ja_learning.core.gaze_line_places import ANGLE_SCALE_RAD
from ja_learning.core.trial import FaceFormat, Look

READING = FaceFormat((6,), np.float32)
"""Yaw, pitch, roll of her head; mean yaw, pitch of the visible eyes; the share that is visible."""

PRIOR = Features(
    np.array([1.0, 1.0, 0.3, 0.5, 0.3, 0.3]), np.array([1.0, 1.0, 0.3, 0.5, 0.3, 0.3])
)
"""Standard deviations of the weights of the features before any trial.

A gaze turns by about as much as head and eyes do, to whichever side; the rest bends this a little.
"""


def read_landmarks(look: Look) -> NDArray[np.float32] | None:
    """Return the reading of a look, (6,), angles in units of `ANGLE_SCALE_RAD`; None without."""
    return None if look.gaze is None else _reading(look.gaze)


def _reading(gaze: FaceGaze) -> NDArray[np.float32]:
    visible = gaze.visible
    eyes = gaze.eyes[visible].mean(axis=0) if visible.any() else np.zeros(2)
    angles = np.concatenate([gaze.head, eyes]) / ANGLE_SCALE_RAD
    return np.append(angles, visible.mean()).astype(np.float32)


def landmark_features(readings: NDArray[np.floating]) -> Features:
    """Return the features of readings (n, 6)."""
    yaw, pitch, roll, eyes_yaw, eyes_pitch, visible = np.asarray(readings, float).T
    hidden, one = 1 - visible, np.ones_like(pitch)
    return Features(
        np.stack([yaw, eyes_yaw, roll, yaw * hidden, yaw**3, yaw * pitch], axis=1),
        np.stack([pitch, eyes_pitch, one, pitch * hidden, yaw**2, pitch**2], axis=1),
    )
