"""How far detections are: the regions whose depth is asked for, and what measures it.

A detection's range is the length of the vector to it. Sensors measure the depth z along the
optical axis; for a thing on the ray (x, y), z = 1, the range is z |(x, y, 1)|.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection
from ja_perception.core.box import Box
from ja_perception.core.features import Mask

# A face fills the middle of its box; at the corners there is background, or hair in front.
_FACE_CORE = 0.5
# What is beyond no sensor of a head measures; a message holds it as 0 or infinite.
_NEAREST_M, _FARTHEST_M = 1e-3, 1e3


class ImageRegion(NamedTuple):
    """A part of an image: a box [px], and which pixels of it belong to the thing.

    ``mask`` (rows, columns) of 0 and 1 spans the box, at any resolution; None: all of the box.
    """

    box: Box
    mask: Mask | None = None


class RangeSensor(Protocol):
    """What measured the depth of the scene at the time of one image."""

    def check(self, image: NDArray[np.uint8]) -> None:
        """Raise ValueError where the measurement does not fit an (H, W, 3) image."""

    def depths(
        self, image: NDArray[np.uint8], regions: Sequence[ImageRegion], camera: CameraModel
    ) -> NDArray[np.float64]:
        """Return the depth z [m] of each region and its standard deviation [m], shape (n, 2).

        NaN where it is not known. ``image``: the (H, W, 3) uint8 RGB picture of ``camera`` in
        which the regions were found. Raises ValueError as `check`.
        """


def face_region(face: Box) -> ImageRegion:
    """Return the part of a face's box in which nothing but the face is seen."""
    return ImageRegion(Box(face.u, face.v, _FACE_CORE * face.width, _FACE_CORE * face.height))


def add_ranges(detections: list[Detection], depths: NDArray[np.float64]) -> list[Detection]:
    """Return the detections with their ranges, from depths and deviations (n, 2) [m]."""
    ranged = []
    for detection, (depth_m, deviation_m) in zip(detections, depths.tolist(), strict=True):
        if _NEAREST_M < depth_m < _FARTHEST_M:  # false for NaN, too
            stretch = math.sqrt(1 + detection.x**2 + detection.y**2)
            detection = detection._replace(
                range_m=stretch * depth_m, range_deviation_m=stretch * deviation_m
            )
        ranged.append(detection)
    return ranged
