"""Upright rectangles in an image."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Box:
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

    def overlap(self, other: 'Box') -> float:
        """Share of the smaller box that lies in the other, 0-1."""
        across = _shared(self.u, self.width, other.u, other.width)
        down = _shared(self.v, self.height, other.v, other.height)
        smaller = min(self.area, other.area)
        return across * down / smaller if smaller > 0 else 0.0


def _shared(a: float, length_a: float, b: float, length_b: float) -> float:
    return max(
        0.0, min(a + length_a / 2, b + length_b / 2) - max(a - length_a / 2, b - length_b / 2)
    )
