"""Motion in the scene, apart from the head's own motion."""

import math
from collections import deque
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.config import Configuration, parameter
from ja_common.core.geometry import head_rotation
from ja_common.core.posture import Posture
from ja_common.core.stamps import NS_PER_S
from ja_perception.core.ego_motion import expected_image, rotation_homography
from ja_perception.core.features import FeatureConfig, Mask, motion_map
from ja_perception.core.undistortion import distort_mask, undistort_image

# Motion is coarse: it is judged on images of at most this width.
_WIDTH_PX = 160
# An image from farther away than this share of the view shares too little with the present one.
_FARTHEST_VIEWS = 0.4
_MOST_PAST = 64


@dataclass(frozen=True)
class MotionConfig(Configuration):
    """Over what time, and up to which speed of the head, motion is judged."""

    motion_span_s: float = parameter(
        0.5, 'time over which a motion must show: longer finds slower movers', low=0.0, high=5.0
    )
    motion_below_rad_s: float = parameter(
        1.6, 'faster than this the picture blurs, and no motion is reported', low=0.0, high=100.0
    )


@dataclass(frozen=True)
class _Past:
    """An image (small, smooth, nowhere 0, undistorted) and the head's rotation at its stamp."""

    grey: Mask
    rotation: NDArray[np.float64]
    stamp_ns: int

    def angle_to(self, other: '_Past') -> float:
        """Return the angle between the two lines of sight [rad]."""
        cosine = float(self.rotation[:, 0] @ other.rotation[:, 0])
        return math.acos(max(-1.0, min(1.0, cosine)))


class MotionDetector:
    """Compares the present image with two earlier ones, each warped by the head's own rotation.

    What moves differs from both. The place that a mover has left differs from one of them only.
    """

    def __init__(self, config: MotionConfig, features: FeatureConfig) -> None:
        self._config = config
        self._features = features
        self._past: deque[_Past] = deque(maxlen=_MOST_PAST)

    def detect_motion(
        self, grey: Mask, stamp_ns: int, camera: CameraModel, posture: Posture | None
    ) -> Mask | None:
        """Return the motion map (H, W) of an (H, W) image; None where motion cannot be judged.

        That is so in the first two images, and while the head turns fast. ``posture`` is the
        head's at the image's stamp; None is a camera that stands still.
        """
        height, width = grey.shape
        if width > _WIDTH_PX:
            size = (_WIDTH_PX, max(1, round(height * _WIDTH_PX / width)))
            grey = cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
        camera = camera.resized(grey.shape[1], grey.shape[0])
        rotation = head_rotation((0.0, 0.0) if posture is None else posture.position)
        # Detail as fine as the pixels looks different after every shift by part of a pixel.
        smooth = cv2.blur(undistort_image(grey, camera), (3, 3))
        present = _Past(cv2.max(smooth, 1), rotation, stamp_ns)
        if posture is not None and not posture.is_still(self._config.motion_below_rad_s):
            self._past.clear()
            return None
        references = self._references(present, camera)
        self._past.append(present)
        if references is None:
            return None
        oldest, middle = references
        moving = self._since(oldest, present, camera)
        if cv2.countNonZero(moving):
            moving &= self._since(middle, present, camera)
        return cv2.resize(
            distort_mask(moving, camera), (width, height), interpolation=cv2.INTER_NEAREST
        )

    def _references(self, present: _Past, camera: CameraModel) -> tuple[_Past, _Past] | None:
        """Return the oldest image within the span and the view, and one half as old."""
        past = self._past
        if past and (
            past[-1].grey.shape != present.grey.shape or past[-1].stamp_ns >= present.stamp_ns
        ):
            past.clear()
        oldest_ns = present.stamp_ns - self._config.motion_span_s * NS_PER_S
        farthest_rad = _FARTHEST_VIEWS * camera.width / camera.fx
        while len(past) > 1 and (
            past[0].stamp_ns < oldest_ns or past[0].angle_to(present) > farthest_rad
        ):
            past.popleft()
        if len(past) < 2:
            return None
        oldest, *later = past
        middle_ns = (oldest.stamp_ns + present.stamp_ns) / 2
        return oldest, min(later, key=lambda p: abs(p.stamp_ns - middle_ns))

    def _since(self, past: _Past, present: _Past, camera: CameraModel) -> Mask:
        homography = rotation_homography(camera, present.rotation, past.rotation)
        expected = expected_image(past.grey, homography)
        return motion_map(present.grey, expected, self._features)
