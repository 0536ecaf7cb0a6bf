"""A pinhole or fisheye camera: between pixels and rays of the optical frame."""

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.lens import Lens


@dataclass(frozen=True)
class CameraModel:
    """Intrinsics in pixels for images of one size; pixel (0, 0) is the centre of the first pixel.

    ``lens`` is None where there is no distortion. ``skew`` holds the entries of K beside fx and
    fy, for sensors whose axes are not at right angles.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    lens: Lens | None = None
    skew: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def from_field_of_view(
        cls, width: int, height: int, field_of_view_rad: float
    ) -> 'CameraModel':
        """Make an ideal camera whose image spans ``field_of_view_rad`` from left to right."""
        focal = width / 2 / math.tan(field_of_view_rad / 2)
        return cls(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)

    @cached_property
    def matrix(self) -> NDArray[np.float64]:
        """Return K, shape (3, 3)."""
        right, down = self.skew
        return np.array([[self.fx, right, self.cx], [down, self.fy, self.cy], [0, 0, 1.0]])

    @cached_property
    def inverse_matrix(self) -> NDArray[np.float64]:
        """Return K^-1, shape (3, 3)."""
        return np.linalg.inv(self.matrix).astype(np.float64)

    @property
    def half_view_rad(self) -> tuple[float, float]:
        """Return half of the angle that the image spans, across and down through its centre."""
        middle = ((self.width - 1) / 2, (self.height - 1) / 2)
        left, right = self.rays([[-0.5, middle[1]], [self.width - 0.5, middle[1]]])[:, 0]
        top, bottom = self.rays([[middle[0], -0.5], [middle[0], self.height - 0.5]])[:, 1]
        return (
            (math.atan(right) - math.atan(left)) / 2,
            (math.atan(bottom) - math.atan(top)) / 2,
        )

    def resized(self, width: int, height: int) -> 'CameraModel':
        """Return the same camera for images of another size [px]."""
        return _resized(self, width, height)

    def cropped(self, left: int, top: int, width: int, height: int) -> 'CameraModel':
        """Return the camera of a window in the image, at pixel (left, top)."""
        return replace(self, width=width, height=height, cx=self.cx - left, cy=self.cy - top)

    def turned(self, quarter_turns: int) -> 'CameraModel':
        """Return the camera of the image turned clockwise by 90 degrees so many times."""
        return _turned(self, quarter_turns % 4)

    def rays(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """Return the rays (x, y), z = 1, of pixels (u, v), both (..., 2), without distortion."""
        pixels = np.asarray(pixels, float)
        if any(self.skew):
            bent = (pixels - (self.cx, self.cy)) @ self.inverse_matrix[:2, :2].T
        else:
            bent = (pixels - (self.cx, self.cy)) / (self.fx, self.fy)
        return bent if self.lens is None else self.lens.straighten(bent)

    def pixels(self, rays: ArrayLike) -> NDArray[np.float64]:
        """Return the pixels (u, v), shape (..., 2), at which rays (x, y) are seen."""
        rays = np.asarray(rays, float)
        return self.straight_pixels(rays if self.lens is None else self.lens.bend(rays))

    def straight_pixels(self, rays: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the pixels, shape (..., 2), of rays (x, y) in the image without distortion."""
        if any(self.skew):
            return rays @ self.matrix[:2, :2].T + (self.cx, self.cy)
        return rays * (self.fx, self.fy) + (self.cx, self.cy)

    def contains(self, pixel: ArrayLike) -> bool:
        """Return whether the pixel (u, v) lies in the image; False for NaN (behind the camera)."""
        u, v = np.asarray(pixel, float)
        return bool(-0.5 <= u < self.width - 0.5 and -0.5 <= v < self.height - 0.5)


@lru_cache(maxsize=16)
def _resized(camera: CameraModel, width: int, height: int) -> CameraModel:
    # Cached: every image asks for it, and its matrices are cached with it.
    sx, sy = width / camera.width, height / camera.height
    right, down = camera.skew
    return replace(
        camera,
        width=width,
        height=height,
        fx=camera.fx * sx,
        fy=camera.fy * sy,
        cx=(camera.cx + 0.5) * sx - 0.5,
        cy=(camera.cy + 0.5) * sy - 0.5,
        skew=(right * sx, down * sy),
    )


@lru_cache(maxsize=16)
def _turned(camera: CameraModel, quarter_turns: int) -> CameraModel:
    for _ in range(quarter_turns):
        lens = camera.lens
        right, down = camera.skew
        camera = CameraModel(
            camera.height, camera.width, camera.fy, camera.fx,
            camera.height - 1 - camera.cy, camera.cx,
            lens and replace(lens, quarter_turns=(lens.quarter_turns + 1) % 4),
            (-down, -right),
        )  # fmt: skip
    return camera
