"""Lens distortion at unit focal length: straight rays to bent ones and back.

Brown's model is OpenCV's (plumb_bob, rational_polynomial, thin prism, tilted sensor). The fisheye
is OpenCV's `cv2.fisheye`, after Kannala and Brandt (2006): `equidistant` in ROS.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

WIDEST_RAD = math.radians(89)
"""A ray with z = 1 reaches no farther from the axis; what a fisheye sees beyond is placed here."""

_UNTIL_EXACT = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-9)
_NEWTON_STEPS = 4


@dataclass(frozen=True)
class Lens:
    """A lens whose ``coefficients`` are OpenCV's: 4, 5, 8, 12 or 14; 4 for a ``fisheye``.

    ``quarter_turns``: how often the camera's image is turned clockwise by 90 degrees. The
    coefficients stay those of the camera as it was calibrated.
    """

    coefficients: tuple[float, ...]
    fisheye: bool = False
    quarter_turns: int = 0

    def straighten(self, bent: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the rays (x, y), z = 1, shape (..., 2), that the lens bends to ``bent``."""
        own = turned(bent.reshape(-1, 2), -self.quarter_turns)
        straight = self._straighten_fisheye(own) if self.fisheye else self._straighten_brown(own)
        return turned(straight, self.quarter_turns).reshape(bent.shape)

    def bend(self, straight: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return where the lens shows rays (x, y), z = 1, shape (..., 2)."""
        own = turned(straight.reshape(-1, 2), -self.quarter_turns)
        bent = self._bend_fisheye(own) if self.fisheye else self._bend_brown(own)
        return turned(bent, self.quarter_turns).reshape(straight.shape)

    def _straighten_brown(self, bent: NDArray[np.float64]) -> NDArray[np.float64]:
        if not len(bent):
            return bent
        # The default of five iterations leaves errors of some hundredths of a pixel.
        return cv2.undistortPointsIter(
            bent[:, None], np.eye(3), np.array(self.coefficients), np.eye(3), np.eye(3),
            _UNTIL_EXACT,
        )[:, 0]  # fmt: skip

    def _bend_brown(self, straight: NDArray[np.float64]) -> NDArray[np.float64]:
        if not len(straight):
            return straight
        points = np.concatenate([straight, np.ones((len(straight), 1))], axis=1)
        seen, _ = cv2.projectPoints(
            points, np.zeros(3), np.zeros(3), np.eye(3), np.array(self.coefficients)
        )
        return seen[:, 0]

    def _straighten_fisheye(self, bent: NDArray[np.float64]) -> NDArray[np.float64]:
        # Own iterations: those of cv2.fisheye return -10^6 where they do not converge.
        wanted = np.linalg.norm(bent, axis=1)
        angles, radii = self._table
        angle = np.interp(wanted, radii, angles)
        for _ in range(_NEWTON_STEPS):
            missing = np.minimum(wanted, radii[-1]) - self._radius(angle)
            angle = np.clip(angle + missing / self._slope(angle), 0.0, angles[-1])
        return bent * _ratio(np.tan(angle), wanted)[:, None]

    def _bend_fisheye(self, straight: NDArray[np.float64]) -> NDArray[np.float64]:
        length = np.linalg.norm(straight, axis=1)
        angle = np.minimum(np.arctan(length), self._table[0][-1])
        return straight * _ratio(self._radius(angle), length)[:, None]

    def _radius(self, angle: NDArray[np.float64]) -> NDArray[np.float64]:
        k1, k2, k3, k4 = self.coefficients
        square = angle**2
        return angle * (1 + square * (k1 + square * (k2 + square * (k3 + square * k4))))

    def _slope(self, angle: NDArray[np.float64]) -> NDArray[np.float64]:
        k1, k2, k3, k4 = self.coefficients
        square = angle**2
        slope = 1 + square * (3 * k1 + square * (5 * k2 + square * (7 * k3 + square * 9 * k4)))
        return np.maximum(slope, 1e-3)

    @cached_property
    def _table(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return angles from the axis [rad] and their radii, up to where the radius still grows.

        Beyond, the polynomial folds back: it was never calibrated there.
        """
        angles = np.linspace(0.0, WIDEST_RAD, 512)
        radii = self._radius(angles)
        folds = np.flatnonzero(np.diff(radii) <= 0)
        end = int(folds[0]) + 1 if len(folds) else len(angles)
        return angles[:end], radii[:end]


def turned(points: NDArray[np.float64], quarter_turns: int) -> NDArray[np.float64]:
    """Return points (x right, y down), shape (n, 2), turned clockwise by 90 degrees each time."""
    x, y = points[:, 0], points[:, 1]
    pairs = ((x, y), (-y, x), (-x, -y), (y, -x))
    return np.column_stack(pairs[quarter_turns % 4])


def _ratio(above: NDArray[np.float64], below: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return above / below, and the limit 1 where both are 0."""
    return np.divide(above, below, out=np.ones_like(above), where=below != 0)
