"""Objects of one image and how interesting each is: Eq. 1 of Nagai, Hosoda and Asada (2003)."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import parameter
from ja_common.core.fixation import WIDTH_SIXTH
from ja_common.core.geometry import directions_of_rays
from ja_common.core.posture import Posture
from ja_perception.core.box import Box
from ja_perception.core.camera_model import CameraModel
from ja_perception.core.ego_motion import expected_image, rotation_homography
from ja_perception.core.features import (
    FeatureConfig,
    Mask,
    colour_map,
    edge_map,
    motion_map,
)
from ja_perception.core.grouping import Grouping, GroupingConfig, merged, texture_window
from ja_perception.core.object_tracking import ObjectTracker, TrackingConfig
from ja_perception.core.undistortion import bent, straightened

# The area within d_th of the centre (Eq. 3) at unit focal length: the measure of f_col and f_mot.
_GAZING_AREA = math.pi * math.tan(WIDTH_SIXTH) ** 2
_MOTION_WIDTH_PX = 160


@dataclass(frozen=True)
class InterestConfig:
    """The coefficients of Eq. 1. A feature of no interest extracts no objects either."""

    alpha_col: float = parameter(1.0, 'alpha 1 of Eq. 1: interest in bright colour', low=0.0)
    alpha_edg: float = parameter(0.0, 'alpha 2 of Eq. 1: interest in texture', low=0.0)
    alpha_mot: float = parameter(0.0, 'alpha 3 of Eq. 1: interest in motion', low=0.0)
    work_width_px: int = parameter(
        320, 'features are computed on images of at most this width', low=32, high=4096
    )
    motion_below_rad_s: float = parameter(
        1.6, 'faster than this the picture blurs, and no motion is reported', low=0.0, high=100.0
    )


@dataclass(frozen=True)
class SalientObject:
    """An object in pixels of the image that was given, with the features of Eq. 1 (each 0-1).

    ``f_col``: area A of its bright colour, ``f_mot``: area A in motion, both as A / (A + G), where
    G is the area within d_th of the centre. ``f_edg``: share of edge pixels in its box.
    """

    box: Box
    track_id: int
    score: float
    f_col: float
    f_edg: float
    f_mot: float


@dataclass(frozen=True)
class _Before:
    """The previous image, for the motion between the two."""

    grey: Mask
    position: NDArray[np.float64]
    stamp_ns: int


class SalientObjects:
    """Extracts objects by bright colour, texture and motion, and weighs them by Eq. 1."""

    def __init__(
        self,
        interest: InterestConfig,
        features: FeatureConfig,
        grouping: GroupingConfig,
        tracking: TrackingConfig,
    ) -> None:
        self._interest = interest
        self._features = features
        self._grouping = Grouping(grouping)
        self._tracker = ObjectTracker(tracking)
        self._before: _Before | None = None
        self.motion_judged = False
        """Could motion be told in the last image? Not in the first, nor while the head is fast."""

    def find(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        camera: CameraModel,
        posture: Posture | None,
        heads: list[Box],
    ) -> list[SalientObject]:
        """Objects in an (H, W, 3) uint8 RGB image, most salient first.

        ``posture`` is the head's at the image's stamp (None: a camera that stands still).
        ``heads`` are the places of people's heads [px]: nothing there is an object.
        """
        scale = min(1.0, self._interest.work_width_px / image.shape[1])
        work = _scaled(image, scale)
        height, width = work.shape[:2]
        work_camera = camera.resized(width, height)
        position = np.zeros(2) if posture is None else posture.position

        colour = colour_map(work, self._features)
        grey = cv2.cvtColor(work, cv2.COLOR_RGB2GRAY)
        edges = edge_map(grey, self._features)
        moving = self._motion(grey, work_camera, posture, stamp_ns)
        for head in heads:
            for feature in (colour.bright, edges, moving):
                _blank(feature, _rescaled(head, scale))

        interest = self._interest
        regions = merged(
            self._grouping.by_colour(colour) if interest.alpha_col else [],
            self._grouping.by_motion(moving) if interest.alpha_mot else [],
            self._grouping.by_texture(edges) if interest.alpha_edg else [],
        )
        boxes = [region.box for region in regions]
        gazing_px = _GAZING_AREA * work_camera.fx * work_camera.fy
        # x / (1 + x): grows with the area but stays below 1, so that no two sizes are equal.
        bright = np.array([region.bright_px for region in regions]) / gazing_px
        moved = _amounts(moving, boxes) / gazing_px
        judged = np.array([max(box.area, texture_window(edges) ** 2) for box in boxes])
        f_col, f_mot = bright / (1 + bright), moved / (1 + moved)
        f_edg = np.minimum(1, _amounts(edges, boxes) / judged)
        saliency = (
            interest.alpha_col * f_col + interest.alpha_edg * f_edg + interest.alpha_mot * f_mot
        )
        boxes = [_rescaled(box, 1 / scale) for box in boxes]
        rays = camera.rays(np.array([(box.u, box.v) for box in boxes]).reshape(-1, 2))
        ids = self._tracker.update(directions_of_rays(position, rays), stamp_ns)
        scores = self._tracker.held(ids, saliency.tolist(), stamp_ns)
        features = (f_col.tolist(), f_edg.tolist(), f_mot.tolist())
        rows = zip(boxes, ids, scores, *features, strict=True)
        objects = [SalientObject(*row) for row in rows]
        return sorted(objects, key=lambda o: -o.score)

    def _motion(
        self, grey: Mask, camera: CameraModel, posture: Posture | None, stamp_ns: int
    ) -> Mask:
        """The motion map, of the size of ``grey``, judged on a smaller image: motion is coarse."""
        height, width = grey.shape
        small = _scaled(grey, min(1.0, _MOTION_WIDTH_PX / width))
        camera = camera.resized(small.shape[1], small.shape[0])
        small = straightened(small, camera)
        position = np.zeros(2) if posture is None else posture.position
        before, self._before = self._before, _Before(small, position, stamp_ns)
        slow = posture is None or posture.is_still(self._interest.motion_below_rad_s)
        comparable = (
            before is not None and before.grey.shape == small.shape and before.stamp_ns < stamp_ns
        )
        self.motion_judged = slow and comparable
        if before is None or not self.motion_judged:
            return np.zeros_like(grey)
        homography = rotation_homography(camera, position, before.position)
        expected, seen_before = expected_image(before.grey, homography)
        moving = bent(motion_map(small, expected, seen_before, self._features), camera)
        return cv2.resize(moving, (width, height), interpolation=cv2.INTER_NEAREST)


def _scaled(image: NDArray[np.uint8], scale: float) -> NDArray[np.uint8]:
    if scale == 1.0:
        return image
    height, width = image.shape[:2]
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    return cv2.resize(image, size, interpolation=cv2.INTER_AREA)


def _rescaled(box: Box, scale: float) -> Box:
    return Box(
        (box.u + 0.5) * scale - 0.5, (box.v + 0.5) * scale - 0.5,
        box.width * scale, box.height * scale,
    )  # fmt: skip


def _blank(feature: Mask, box: Box) -> None:
    top, left = max(0, round(box.top)), max(0, round(box.left))
    bottom, right = round(box.top + box.height), round(box.left + box.width)
    if bottom > 0 and right > 0:
        feature[top:bottom, left:right] = 0


def _amounts(feature: Mask, boxes: list[Box]) -> NDArray[np.float64]:
    """Sum of a feature in each box, shape (n,)."""
    sums = cv2.integral(feature)
    corners = np.array(
        [(b.top, b.left, b.top + b.height, b.left + b.width) for b in boxes]
    ).reshape(-1, 4)
    top, left, bottom, right = np.round(corners + 0.5).astype(int).T
    return (sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]).astype(
        float
    )
