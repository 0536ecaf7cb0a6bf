"""The depth of regions in a depth picture that is registered to the camera's image."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_perception.core.ranging import ImageRegion

# So many depths are read of a region: more cost time and make the median no better.
_SAMPLES = 400
_LEAST_SAMPLES = 6
_LEAST_KNOWN = 0.15  # share of the pixels read
# The surface of a thing lies within this share of its distance.
_SURFACE = 0.08
# The nearest surface that fills this share of a region is the thing, what is behind it is not.
_NEAREST = 0.25
_STEPS = 4
# Registration and calibration err by about this share, however many pixels agree.
_LEAST_DEVIATION = 0.01
# The sides may differ in proportion by the rounding to whole pixels.
_ROUNDING = 0.02


@dataclass(frozen=True, eq=False)
class DepthPicture:
    """Distances along the optical axis, (H, W), of the same view as the camera's image.

    ``samples`` times ``unit_m`` are metres: float32 [m] or uint16 [mm] as in REP-118, in any byte
    order. What is not finite or not above 0 is a hole. The size may differ from the image's.
    """

    samples: NDArray[Any]
    unit_m: float = 1.0

    def check(self, image: NDArray[np.uint8]) -> None:
        """Raise ValueError where this picture has another shape than the camera's image."""
        across, down = self._scales(image)
        height, width = image.shape[:2]
        if abs(across - down) > max(_ROUNDING * across, 1 / width, 1 / height):
            rows, columns = self.samples.shape
            raise ValueError(
                f'the depth picture is {columns}x{rows}, but the image {width}x{height}: another '
                'shape, so it is not registered to the image; publish depth that is aligned to it'
            )

    def _scales(self, image: NDArray[np.uint8]) -> tuple[float, float]:
        """Return how many columns and rows there are for one of the image."""
        rows, columns = self.samples.shape
        return columns / image.shape[1], rows / image.shape[0]

    def depths(
        self, image: NDArray[np.uint8], regions: Sequence[ImageRegion], camera: CameraModel
    ) -> NDArray[np.float64]:
        """Return the median depth z [m] of each region and its deviation [m], shape (n, 2).

        NaN where too few pixels are known. Raises ValueError as `check`.
        """
        self.check(image)
        across, down = self._scales(image)
        found = np.full((len(regions), 2), np.nan)
        for index, region in enumerate(regions):
            found[index] = surface_depth(self._read(region, across, down))
        return found

    def _read(self, region: ImageRegion, across: float, down: float) -> NDArray[np.float32]:
        """Return the depths (n,) [m] of a region, NaN or 0 for holes; a sample of its pixels."""
        box, mask = region
        rows, columns = (
            (max(1, round(box.height)), max(1, round(box.width))) if mask is None else mask.shape
        )
        own = rows * columns if mask is None else cv2.countNonZero(mask)
        step = max(1, math.isqrt(own // _SAMPLES))
        v, row_inside = _grid(box.top, box.height, rows, step, down, self.samples.shape[0])
        u, column_inside = _grid(box.left, box.width, columns, step, across, self.samples.shape[1])
        depth = self.samples[v[:, None], u]
        if mask is None:
            depth = depth.ravel()
        else:
            depth = depth[
                mask[step // 2 :: step, step // 2 :: step][row_inside, column_inside] > 0
            ]
        return depth.astype(np.float32) * np.float32(self.unit_m)


def _grid(
    start: float, length: float, count: int, step: int, scale: float, size: int
) -> tuple[NDArray[np.intp], slice]:
    """Return every ``step``-th of ``count`` places in a side of a box, as pixels of the depth.

    ``start`` and ``length`` [px of the image]; ``size``: pixels of the depth picture. Places
    outside of it are left out; the slice has those that remain.
    """
    places = np.arange(step // 2, count, step) + 0.5
    places *= scale * length / count
    places += scale * (start + 0.5)
    first, last = np.searchsorted(places, (0.0, size)).tolist()
    return places[first:last].astype(np.intp), slice(first, last)


def surface_depth(depths: NDArray[np.float32]) -> tuple[float, float]:
    """Return the median depth of the nearest surface among depths (n,), and its deviation.

    Holes are what is not finite or not positive. The surface is found by steps of the mean shift
    (Comaniciu and Meer 2002, here with medians) from the nearer pixels on, so that neither what
    is behind it in the region counts, nor pixels at its rim that mix both. The deviation is 1.4826
    MAD of the surface, but not less than 1 % of the depth: a thing has an extent, and a sensor an
    error that all pixels share.
    """
    known = depths[(depths > 0) & (depths < np.inf)]
    known.sort()
    count = len(known)
    if count < max(_LEAST_SAMPLES, _LEAST_KNOWN * len(depths)):
        return math.nan, math.nan
    depth = float(known[int(_NEAREST * count)])
    low = high = 0
    for _ in range(_STEPS):
        ends = known.searchsorted(((1 - _SURFACE) * depth, (1 + _SURFACE) * depth)).tolist()
        if ends == [low, high]:
            break
        low, high = ends
        depth = float(known[(low + high) // 2])
    apart = np.abs(known[low:high] - np.float32(depth))
    apart.sort()
    deviation = 1.4826 * float(apart[len(apart) // 2])
    return depth, max(deviation, _LEAST_DEVIATION * depth)
