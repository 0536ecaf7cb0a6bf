"""A pinhole camera with lens distortion: between pixels and rays of the optical frame."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

_UNTIL_EXACT = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-6)


@dataclass(frozen=True)
class CameraModel:
    """Intrinsics in pixels for images of one size; pixel (0, 0) is the centre of the first pixel.

    ``distortion`` holds OpenCV's coefficients (plumb_bob, or rational_polynomial when longer);
    empty means none.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()

    @classmethod
    def from_field_of_view(
        cls, width: int, height: int, field_of_view_rad: float
    ) -> 'CameraModel':
        """Make an ideal camera whose image spans ``field_of_view_rad`` from left to right."""
        focal = width / 2 / math.tan(field_of_view_rad / 2)
        return cls(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)

    @classmethod
    def from_calibration(
        cls, width: int, height: int, k: Sequence[float], distortion: Sequence[float] = ()
    ) -> 'CameraModel | None':
        """Make a camera from the row-major 3x3 matrix ``k`` of CameraInfo; None when it is zero.

        A matrix of zeros means that the camera is not calibrated. Raises ``ValueError``
        when the focal lengths are not positive and finite.
        """
        fx, fy, cx, cy = k[0], k[4], k[2], k[5]
        if not any(k):
            return None
        if not (all(math.isfinite(value) for value in (fx, fy, cx, cy)) and min(fx, fy) > 0):
            raise ValueError(f'focal lengths must be positive, not fx={fx} fy={fy}')
        distorted = any(distortion)
        return cls(width, height, fx, fy, cx, cy, tuple(distortion) if distorted else ())

    @cached_property
    def matrix(self) -> NDArray[np.float64]:
        """Return K, shape (3, 3)."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    @cached_property
    def inverse_matrix(self) -> NDArray[np.float64]:
        """Return K^-1, shape (3, 3)."""
        return np.linalg.inv(self.matrix).astype(np.float64)

    def resized(self, width: int, height: int) -> 'CameraModel':
        """Return the same camera for images of another size [px]."""
        return _resized(self, width, height)

    def rays(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """Return the rays (x, y), z = 1, of pixels (u, v), both (..., 2), without distortion."""
        pixels = np.asarray(pixels, float)
        if self.distortion:
            # The default of five iterations leaves errors of some hundredths of a pixel.
            points = cv2.undistortPointsIter(
                pixels.reshape(-1, 1, 2), self.matrix, np.array(self.distortion),
                np.eye(3), np.eye(3), _UNTIL_EXACT,
            )  # fmt: skip
            return points.reshape(pixels.shape)
        return (pixels - (self.cx, self.cy)) / (self.fx, self.fy)

    def pixels(self, rays: ArrayLike) -> NDArray[np.float64]:
        """Return the pixels (u, v), shape (..., 2), at which rays (x, y) are seen."""
        rays = np.asarray(rays, float)
        if self.distortion:
            points = np.concatenate([rays.reshape(-1, 2), np.ones((rays.size // 2, 1))], axis=1)
            seen, _ = cv2.projectPoints(
                points, np.zeros(3), np.zeros(3), self.matrix, np.array(self.distortion)
            )
            return seen.reshape(rays.shape)
        return rays * (self.fx, self.fy) + (self.cx, self.cy)

    def contains(self, pixel: ArrayLike) -> bool:
        """Return whether the pixel (u, v) lies in the image; False for NaN (behind the camera)."""
        u, v = np.asarray(pixel, float)
        return bool(-0.5 <= u < self.width - 0.5 and -0.5 <= v < self.height - 0.5)


@lru_cache(maxsize=16)
def _resized(camera: CameraModel, width: int, height: int) -> CameraModel:
    # Cached: every image asks for it, and its matrices are cached with it.
    sx, sy = width / camera.width, height / camera.height
    return replace(
        camera,
        width=width,
        height=height,
        fx=camera.fx * sx,
        fy=camera.fy * sy,
        cx=(camera.cx + 0.5) * sx - 0.5,
        cy=(camera.cy + 0.5) * sy - 0.5,
    )
