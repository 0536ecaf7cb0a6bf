"""Upright rectangles in an image."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

# An empty box overlaps nothing.
_TINY = 1e-12
# Pixel (0, 0) is the centre of the first pixel: the image begins half a pixel before it.
_PIXEL_CENTRE = np.array([0.5, 0.5, 0.0, 0.0])
# From (u, v, width, height) to (left, top, right, bottom).
_CORNERS = np.array([[1, 0, 1, 0], [0, 1, 0, 1], [-0.5, 0, 0.5, 0], [0, -0.5, 0, 0.5]])


class Box(NamedTuple):
    """An upright rectangle in the image: centre (u, v) and size [px]."""

    u: float
    v: float
    width: float
    height: float

    @property
    def left(self) -> float:
        """Return the left edge [px]."""
        return self.u - self.width / 2

    @property
    def top(self) -> float:
        """Return the upper edge [px]."""
        return self.v - self.height / 2

    @property
    def area(self) -> float:
        """Return the area [px^2]."""
        return self.width * self.height

    def scaled(self, factor: float) -> 'Box':
        """Return the same place in an image ``factor`` times as large."""
        u, v = (self.u + 0.5) * factor - 0.5, (self.v + 0.5) * factor - 0.5
        return Box(u, v, self.width * factor, self.height * factor)

    def overlap(self, other: 'Box') -> float:
        """Return the share of the smaller box that lies in the other, 0-1."""
        return float(overlaps([self], [other])[0, 0])


def scaled(boxes: NDArray[np.float64], factor: float) -> NDArray[np.float64]:
    """Return ``Box.scaled`` of each of the boxes (n, 4)."""
    return (boxes + _PIXEL_CENTRE) * factor - _PIXEL_CENTRE


def corners(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return left, top, right and bottom, shape (n, 4), of boxes (n, 4)."""
    return boxes @ _CORNERS


def overlaps(boxes: ArrayLike, others: ArrayLike) -> NDArray[np.float64]:
    """Return ``Box.overlap`` of ``boxes`` (n, 4) with ``others`` (m, 4), shape (n, m)."""
    one = np.asarray(boxes, float).reshape(-1, 1, 4)
    other = np.asarray(others, float).reshape(1, -1, 4)
    first, second = corners(one), corners(other)
    sides = np.minimum(first[..., 2:], second[..., 2:])
    sides -= np.maximum(first[..., :2], second[..., :2])
    np.maximum(sides, 0.0, out=sides)
    areas = np.minimum(one[..., 2] * one[..., 3], other[..., 2] * other[..., 3])
    return sides[..., 0] * sides[..., 1] / np.maximum(areas, _TINY)
