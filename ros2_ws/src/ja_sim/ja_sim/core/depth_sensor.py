"""A depth sensor: from the depth of the rendered scene to what a real sensor would measure.

Structured light and stereo alike match the pictures of two imagers, ``b`` apart. A match gives a
disparity ``d = f b / z``, so that a constant error of the disparity becomes an error of depth that
grows with the square of the distance:

    sd(z) = z^2 / (f b) sd(d)

(Khoshelham & Elberink, *Accuracy and resolution of Kinect depth data for indoor mapping
applications*, Sensors 12, 2012; Keselman et al., *Intel RealSense stereoscopic depth cameras*,
2017, for the D400 series: 0.1 px or less, b = 50 mm). Steep surfaces, and what only one of the
imagers sees, give no match (Nguyen, Izadi & Lovell, *Modeling Kinect sensor noise for improved 3D
reconstruction and tracking*, 2012: none beyond about 80 degrees).
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_sim.core.camera import Intrinsics
from ja_sim.core.specs import SensesSpec

_HIDDEN_BY_PX = 1.0
"""What is nearer by this disparity [px of the picture] hides what is behind it."""


class DepthSensor:
    """Turns exact depth pictures into measured ones; one is made for each run of a world."""

    def __init__(self, spec: SensesSpec, intrinsics: Intrinsics, rng: np.random.Generator) -> None:
        """Draw the error of calibration that stays the same in the whole run."""
        self._spec, self._intrinsics, self._rng = spec, intrinsics, rng
        self._scale = 1.0 + spec.depth_scale_deviation * float(rng.standard_normal())

    def measure(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the measured depth (H, W) [m] of an exact one; NaN where there is none."""
        spec = self._spec
        # Disparity [px of the sensor's own imager].
        sensor = np.float32(spec.depth_focal_px * spec.depth_baseline_m)
        disparity = sensor / depth
        if spec.disparity_noise_px:
            disparity += spec.disparity_noise_px * self._noise(depth.shape)
        if spec.disparity_step_px:
            step = np.float32(spec.disparity_step_px)
            disparity = np.round(disparity / step) * step
        nearest, farthest = spec.depth_range_m
        with np.errstate(divide='ignore'):  # a disparity of 0: infinitely far
            measured = np.float32(self._scale) * (sensor / disparity)
        missing = self._is_hidden(depth) | self._is_grazed(depth)
        missing |= (measured < nearest) | (measured > farthest)
        measured[missing] = np.nan
        return np.asarray(measured, np.float32)

    def _noise(self, shape: tuple[int, ...]) -> NDArray[np.float32]:
        """Return errors (H, W) of unit variance, alike within the matching window."""
        noise = self._rng.standard_normal(shape, np.float32)
        # The window is of the sensor's own pixels; here of as many degrees.
        width = self._spec.matching_window_px * self._intrinsics.fx / self._spec.depth_focal_px
        sigma = width / math.sqrt(12.0)  # the Gaussian as wide as a box of this width
        if sigma < 0.3:  # narrower than a pixel
            return noise
        size = 2 * math.ceil(3.0 * sigma) + 1
        kernel = cv2.getGaussianKernel(size, sigma, cv2.CV_32F)
        kernel /= np.linalg.norm(kernel)  # the variance stays 1
        return np.asarray(cv2.sepFilter2D(noise, -1, kernel, kernel), np.float32)

    def _is_hidden(self, depth: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return where the right imager's view is blocked by something nearer, (H, W).

        It sees a pixel of column u at u - d. The shadow is on the left side of near things.
        """
        height, width = depth.shape
        disparity = np.float32(self._intrinsics.fx * self._spec.depth_baseline_m) / depth
        column = np.arange(width, dtype=np.float32) - disparity
        # Rows one after the other in one line; what leaves the right imager's view to the left
        # is in a margin.
        margin = math.ceil(float(disparity.max())) + 1
        stride = width + margin + 1
        place = np.rint(column).astype(np.int32) + margin
        place += (np.arange(height, dtype=np.int32) * stride)[:, None]
        nearest = np.zeros(height * stride, np.float32)
        np.maximum.at(nearest, place.ravel(), disparity.ravel())
        return np.asarray(nearest[place] > disparity + _HIDDEN_BY_PX)

    def _is_grazed(self, depth: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return where the surface is steeper than a match allows, (H, W).

        At the edge of a near thing the neighbouring pixels are on a steep step: no match either.
        """
        if self._spec.grazing_deg >= 90.0:
            return np.zeros(depth.shape, bool)
        du = self._intrinsics.fx / 2.0 * cv2.filter2D(depth, -1, np.array([[-1.0, 0.0, 1.0]]))
        dv = self._intrinsics.fy / 2.0 * cv2.filter2D(depth, -1, np.array([[-1.0], [0.0], [1.0]]))
        # The tangent of the angle between the surface's normal and the line of sight.
        limit = math.tan(math.radians(self._spec.grazing_deg))
        return np.asarray(np.hypot(du, dv) > limit * depth)
