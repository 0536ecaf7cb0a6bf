"""Objects of one image and their saliency: Eq. 1 of Nagai, Hosoda and Asada (2003)."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.config import Configuration, parameter
from ja_common.core.detection import Detection, Kind
from ja_common.core.fixation import WIDTH_SIXTH
from ja_common.core.geometry import vectors_of_rays
from ja_common.core.posture import Posture
from ja_perception.core.box import Box, corners, scaled
from ja_perception.core.features import ColourMap, FeatureConfig, Mask, colour_map, edge_map
from ja_perception.core.grouping import (
    Grouping,
    GroupingConfig,
    Region,
    merge_regions,
    texture_window,
)
from ja_perception.core.motion import MotionConfig, MotionDetector
from ja_perception.core.object_tracking import ObjectTracker, TrackingConfig
from ja_perception.core.patches import Patch

# The area within d_th of the centre (Eq. 3) at unit focal length: the measure of f_col and f_mot.
_GAZING_AREA = math.pi * math.tan(WIDTH_SIXTH) ** 2


@dataclass(frozen=True)
class InterestConfig(Configuration):
    """The coefficients of Eq. 1. A feature of no interest is not computed, and counts as 0."""

    alpha_col: float = parameter(1.0, 'alpha 1 of Eq. 1: interest in bright colour', low=0.0)
    alpha_edg: float = parameter(0.0, 'alpha 2 of Eq. 1: interest in texture', low=0.0)
    alpha_mot: float = parameter(0.0, 'alpha 3 of Eq. 1: interest in motion', low=0.0)
    work_width_px: int = parameter(
        160, 'features are computed on images of at most this width', low=32, high=4096
    )


@dataclass(frozen=True)
class _Maps:
    """The feature maps of one working image, without people's heads."""

    colour: ColourMap
    edges: Mask
    moving: Mask


class SalientObjects:
    """Extracts objects by bright colour, texture and motion, and ranks them by Eq. 1."""

    def __init__(
        self,
        interest: InterestConfig,
        features: FeatureConfig,
        motion: MotionConfig,
        grouping: GroupingConfig,
        tracking: TrackingConfig,
    ) -> None:
        self._interest = interest
        self._features = features
        self._grouping = Grouping(grouping)
        self._tracker = ObjectTracker(tracking)
        self._motion = MotionDetector(motion, features)
        self.motion_judged = False
        """Was motion judged in the last image? See ``MotionDetector.detect_motion``."""
        self.moving_share = 0.0
        """Share of the last image that moved."""
        self._patches: list[Patch | None] = []

    def masks(self) -> list[Mask | None]:
        """Return the own pixels of each object of the last image, in the order of the objects.

        A mask (rows, columns) of 0 and 1 spans the object's box.
        """
        return [None if patch is None else patch.mask for patch in self._patches]

    def find_objects(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        camera: CameraModel,
        posture: Posture | None,
        heads: list[Box],
    ) -> list[Detection]:
        """Return the objects in an (H, W, 3) uint8 RGB image, most salient first (Eq. 1).

        ``f_col``: area A of its bright colour, ``f_mot``: area A in motion, both as A / (A + G),
        where G is the area within d_th of the centre. ``f_edg``: share of edge pixels in its box.

        ``posture`` is the head's at the image's stamp (None: a camera that stands still).
        ``heads`` are the places of people's heads [px]: nothing there is an object.
        """
        scale = min(1.0, self._interest.work_width_px / image.shape[1])
        work = _scaled(image, scale)
        work_camera = camera.resized(work.shape[1], work.shape[0])
        work_heads = [head.scaled(scale) for head in heads]
        maps = self._maps(work, stamp_ns, work_camera, posture, work_heads)
        regions = self._regions(maps)
        work_boxes = np.array([region.box for region in regions], float).reshape(-1, 4)
        bright_px = np.array([region.bright_px for region in regions], float)
        features = _features(work_boxes, bright_px, maps, work_camera)

        interest = self._interest
        # Eq. 1
        saliency = features @ (interest.alpha_col, interest.alpha_edg, interest.alpha_mot)
        boxes = scaled(work_boxes, 1 / scale)
        rays = camera.rays(boxes[:, :2])
        position = np.zeros(2) if posture is None else posture.position
        ids = self._tracker.update(vectors_of_rays(position, rays), stamp_ns)
        scores = self._tracker.apply_hysteresis(ids, saliency.tolist(), stamp_ns)
        rows = zip(rays.tolist(), boxes.tolist(), scores, ids, features.tolist(), strict=True)
        objects = [
            Detection(Kind.OBJECT, x, y, u, v, width, height, score, track_id, f_col, f_edg, f_mot)
            for (x, y), (u, v, width, height), score, track_id, (f_col, f_edg, f_mot) in rows
        ]
        order = sorted(range(len(objects)), key=lambda index: -objects[index].score)
        self._patches = [regions[index].patch for index in order]
        return [objects[index] for index in order]

    def _maps(
        self,
        work: NDArray[np.uint8],
        stamp_ns: int,
        camera: CameraModel,
        posture: Posture | None,
        heads: list[Box],
    ) -> _Maps:
        interest = self._interest
        grey = cv2.cvtColor(work, cv2.COLOR_RGB2GRAY)
        nothing = np.zeros_like(grey)
        colour, edges, moving = ColourMap(nothing, nothing), nothing, None
        if interest.alpha_col:
            colour = colour_map(work, self._features)
        if interest.alpha_edg:
            edges = edge_map(grey, self._features)
        if interest.alpha_mot:
            moving = self._motion.detect_motion(grey, stamp_ns, camera, posture)
        self.motion_judged = moving is not None
        moving = nothing if moving is None else moving
        self.moving_share = cv2.countNonZero(moving) / moving.size
        for head in heads:
            for feature in (colour.bright, edges, moving):
                _blank(feature, head)
        return _Maps(colour, edges, moving)

    def _regions(self, maps: _Maps) -> list[Region]:
        interest = self._interest
        return merge_regions(
            self._grouping.group_by_colour(maps.colour) if interest.alpha_col else [],
            self._grouping.group_by_motion(maps.moving) if interest.alpha_mot else [],
            self._grouping.group_by_texture(maps.edges) if interest.alpha_edg else [],
        )


def _features(
    boxes: NDArray[np.float64], bright_px: NDArray[np.float64], maps: _Maps, camera: CameraModel
) -> NDArray[np.float64]:
    """Return f_col, f_edg and f_mot, shape (n, 3), of boxes (n, 4) with ``bright_px`` (n,)."""
    height, width = maps.edges.shape
    # A box from a coarser map may reach a pixel beyond the image.
    edges = np.minimum(np.rint(corners(boxes) + 0.5), (width, height, width, height))
    edges = edges.astype(int).T
    edge_px, moving_px = _amounts(maps.edges, edges), _amounts(maps.moving, edges)
    # In less than a window of texture, a few edges would seem dense.
    judged_px = np.maximum(boxes[:, 2] * boxes[:, 3], texture_window(maps.edges) ** 2)
    features = np.empty((len(boxes), 3))
    gazing_px = _GAZING_AREA * camera.fx * camera.fy
    # A / (A + G) grows with the area A but stays below 1, so that no two sizes are equal.
    features[:, 0] = bright_px / (bright_px + gazing_px)
    features[:, 1] = np.minimum(edge_px / judged_px, 1)
    features[:, 2] = moving_px / (moving_px + gazing_px)
    return features


def _scaled(image: NDArray[np.uint8], scale: float) -> NDArray[np.uint8]:
    height, width = image.shape[:2]
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    # OpenCV halves with a special kernel: halving twice is three times as fast as one quarter.
    while width >= 2 * size[0] and height >= 2 * size[1]:
        width, height = (width + 1) // 2, (height + 1) // 2
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    if (width, height) != size:
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return image


def _blank(feature: Mask, box: Box) -> None:
    top, left = max(0, round(box.top)), max(0, round(box.left))
    bottom, right = round(box.top + box.height), round(box.left + box.width)
    if bottom > 0 and right > 0:
        feature[top:bottom, left:right] = 0


def _amounts(feature: Mask, edges: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the sum of a feature in each box (n,), of edges left, top, right, bottom (4, n)."""
    sums = cv2.integral(feature)
    left, top, right, bottom = edges
    return sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
