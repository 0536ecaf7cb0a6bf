"""Where a face and its eyes are turned, as a reader of landmarks measures it in one image."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

LEFT, RIGHT = 0, 1
"""Rows of `FaceGaze.eyes`: her own left and right eye."""


class FaceGaze(NamedTuple):
    """Head pose and eye-in-head angles of one face.

    All angles have the signs of the robot's head: yaw is positive towards the robot's left, pitch
    is positive downwards. `head`: yaw, pitch, roll (3,) [rad] of her head; zero when it faces the
    camera, wherever she stands in the view. `head_deviation_rad`: the standard deviation of yaw
    and pitch. `eyes`: yaw and pitch of each eye in the head (2, 2) [rad], her left eye first; NaN
    where the eye is not visible. `eye_deviation_rad`: their standard deviation.
    """

    head: NDArray[np.float64]
    head_deviation_rad: float
    eyes: NDArray[np.float64]
    eye_deviation_rad: float

    @property
    def visible(self) -> NDArray[np.bool_]:
        """Return which eyes are visible, (2,), her left one first."""
        return np.asarray(np.isfinite(self.eyes).all(axis=1))

    def as_row(self) -> NDArray[np.float64]:
        """Return all numbers in the order of the fields, (9,)."""
        head = [*self.head, self.head_deviation_rad]
        return np.array([*head, *self.eyes.ravel(), self.eye_deviation_rad], float)

    @staticmethod
    def from_row(row: NDArray[np.floating]) -> 'FaceGaze | None':
        """Return the reading of a row (9,) of `as_row`; None where its head pose is NaN."""
        if np.isnan(row[:3]).any():
            return None
        values: NDArray[np.float64] = np.array(row, float)
        eyes = values[4:8].reshape(2, 2)
        return FaceGaze(values[:3], float(values[3]), eyes, float(values[8]))

    def mirrored(self) -> 'FaceGaze':
        """Return what the mirror image of this face would give."""
        sign = np.array([-1.0, 1.0, -1.0])
        return self._replace(head=sign * self.head, eyes=sign[:2] * self.eyes[::-1])
