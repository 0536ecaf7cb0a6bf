"""Upright rectangles in an image."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

# An empty box overlaps nothing.
_TINY = 1e-12


class Box(NamedTuple):
    """An upright rectangle in the image: centre (u, v) and size [px]."""

    u: float
    v: float
    width: float
    height: float

    @property
    def left(self) -> float:
        return self.u - self.width / 2

    @property
    def top(self) -> float:
        return self.v - self.height / 2

    @property
    def area(self) -> float:
        return self.width * self.height

    def scaled(self, factor: float) -> 'Box':
        """The same place in an image ``factor`` times as large."""
        u, v = (self.u + 0.5) * factor - 0.5, (self.v + 0.5) * factor - 0.5
        return Box(u, v, self.width * factor, self.height * factor)

    def overlap(self, other: 'Box') -> float:
        """Share of the smaller box that lies in the other, 0-1."""
        return float(overlaps([self], [other])[0, 0])


def overlaps(boxes: Sequence[Box], others: Sequence[Box]) -> NDArray[np.float64]:
    """``Box.overlap`` of each of ``boxes`` with each of ``others``, shape (n, m)."""
    one = np.array(boxes, float).reshape(-1, 1, 4)
    other = np.array(others, float).reshape(1, -1, 4)
    reach = (one[..., 2:] + other[..., 2:]) / 2 - np.abs(one[..., :2] - other[..., :2])
    narrower = np.minimum(one[..., 2:], other[..., 2:])
    shared = np.maximum(np.minimum(reach, narrower), 0.0)
    areas = np.minimum(one[..., 2] * one[..., 3], other[..., 2] * other[..., 3])
    return shared[..., 0] * shared[..., 1] / np.maximum(areas, _TINY)
