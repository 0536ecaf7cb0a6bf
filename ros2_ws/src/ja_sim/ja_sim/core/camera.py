"""The camera on the head: its intrinsics, and the effects of exposure on a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ja_sim.core.specs import HeadSpec


@dataclass(frozen=True)
class Intrinsics:
    """Pinhole model [px]: ``u = fx x + cx``, ``v = fy y + cy`` for a ray (x, y, 1)."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @classmethod
    def from_view(cls, spec: HeadSpec, image_size: tuple[int, int]) -> Intrinsics:
        """Return the camera whose picture of (width, height) [px] spans the head's view."""
        width, height = image_size
        return cls(
            width,
            height,
            fx=width / 2.0 / math.tan(math.radians(spec.view_pan_deg)),
            fy=height / 2.0 / math.tan(math.radians(spec.view_tilt_deg)),
            cx=(width - 1) / 2.0,
            cy=(height - 1) / 2.0,
        )


@dataclass(frozen=True)
class Observation:
    """A picture (H, W, 3) uint8 RGB, stamped with the time of its exposure.

    ``depth`` (H, W) float32: distances along the optical axis [m], NaN where none was measured.
    ``right`` (H, W, 3) uint8 RGB: the second camera's picture, of the same intrinsics. Both are of
    the same exposure, and None where the scene's `SensesSpec` has them off.
    """

    image: np.ndarray
    stamp_ns: int
    intrinsics: Intrinsics
    depth: np.ndarray | None = None
    right: np.ndarray | None = None

    @property
    def fx(self) -> float:
        """Return the horizontal focal length [px]."""
        return self.intrinsics.fx

    @property
    def fy(self) -> float:
        """Return the vertical focal length [px]."""
        return self.intrinsics.fy

    @property
    def cx(self) -> float:
        """Return the column of the optical axis [px]."""
        return self.intrinsics.cx

    @property
    def cy(self) -> float:
        """Return the row of the optical axis [px]."""
        return self.intrinsics.cy


def expose(
    image: np.ndarray,
    velocity: np.ndarray,
    intrinsics: Intrinsics,
    spec: HeadSpec,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return a sharp picture as exposed while the head turns at ``velocity`` (2,) [rad/s].

    A turning camera smears the whole picture alike, so that motion blur is one line-shaped filter.
    """
    smear = velocity * spec.exposure_time_s * (intrinsics.fx, intrinsics.fy)
    if np.hypot(*smear) > 1.0:
        image = cv2.filter2D(image, -1, _line_kernel(smear), borderType=cv2.BORDER_REPLICATE)
    if spec.exposure_gain == 1.0 and spec.image_noise == 0.0:
        return image
    grey = image.astype(np.float32) * spec.exposure_gain
    if spec.image_noise:
        grey += spec.image_noise * rng.standard_normal(image.shape, np.float32)
    return np.clip(grey, 0.0, 255.0).astype(np.uint8)


def _line_kernel(smear: np.ndarray) -> np.ndarray:
    """Return a filter that averages along (du, dv) [px], centred."""
    half = math.ceil(float(np.max(np.abs(smear))) / 2.0)
    kernel = np.zeros((2 * half + 1, 2 * half + 1), np.float32)
    steps = np.round(np.linspace(-0.5, 0.5, 4 * half + 1)[:, None] * smear).astype(int) + half
    kernel[steps[:, 1], steps[:, 0]] = 1.0
    return kernel / kernel.sum()
