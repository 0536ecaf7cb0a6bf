"""The view expected now if only the head has moved since the previous image."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel

# From the head frame (x forward, y left, z up) to the optical frame (x right, y down, z forward).
_OPTICAL_FROM_HEAD = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])

# A turn whose perspective bends no part of the image by more than this [px] counts as affine.
_BENT_PX = 0.5


def rotation_homography(
    camera: CameraModel, head_now: NDArray[np.float64], head_before: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return H = K R_now R_before^T K^-1, (3, 3): pixels of the image before -> pixels now.

    R turns the base frame into the optical frame. ``head_now`` and ``head_before`` are the
    ``head_rotation`` (3, 3) of the postures at the images' stamps. The camera turns about its
    optical centre, so the depth of the scene plays no part.
    """
    to_pixels = camera.matrix @ _OPTICAL_FROM_HEAD
    from_pixels = _OPTICAL_FROM_HEAD.T @ camera.inverse_matrix
    return to_pixels @ head_now.T @ head_before @ from_pixels


def expected_image(
    before: NDArray[np.uint8], homography: NDArray[np.float64]
) -> NDArray[np.uint8]:
    """Return the (H, W) image before, warped to the view now; 0 where it had no view.

    The image before must be nowhere 0.
    """
    height, width = before.shape
    if not _in_front(width, height, homography):
        return np.zeros_like(before)
    affine = _affine(width, height, homography)
    if affine is None:
        return cv2.warpPerspective(before, homography, (width, height), flags=cv2.INTER_NEAREST)
    # Three times as fast; possible while the head rests or turns little.
    return cv2.warpAffine(before, affine, (width, height), flags=cv2.INTER_NEAREST)


def _in_front(width: int, height: int, homography: NDArray[np.float64]) -> bool:
    """Return whether the whole image before lies in front of the camera now."""
    across, down, depth = homography[2].tolist()
    return depth + min(0.0, across * width) + min(0.0, down * height) > 1e-6


def _affine(
    width: int, height: int, homography: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Return the affine map (2, 3) near the homography; None where perspective bends more."""
    right, down = width / 2, height / 2
    # With a depth of 1 at the centre, it is 1 + slope @ (u, v, 1) elsewhere.
    unit = homography / float(homography[2] @ (right, down, 1.0))
    slope = unit[2] - (0.0, 0.0, 1.0)
    at_corners = abs(float(slope[0])) * right + abs(float(slope[1])) * down
    if at_corners * math.hypot(right, down) > _BENT_PX:
        return None
    centre = unit[:2] @ (right, down, 1.0)
    return unit[:2] - centre[:, None] * slope
