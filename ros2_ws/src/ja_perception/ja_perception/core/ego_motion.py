"""What the camera would see now if only the head had moved since the previous image."""

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.geometry import head_rotation
from ja_perception.core.camera_model import CameraModel

# From the head frame (x forward, y left, z up) to the optical frame (x right, y down, z forward).
_OPTICAL_FROM_HEAD = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])


def rotation_homography(
    camera: CameraModel, posture_now: ArrayLike, posture_before: ArrayLike
) -> NDArray[np.float64]:
    """H = K R_now R_before^T K^-1, shape (3, 3): pixels of the image before -> pixels now.

    R turns the base frame into the optical frame; postures are (pan, tilt) [rad] at the images'
    stamps. The camera turns about its optical centre, so the depth of the scene plays no part.
    """
    now_from_before = head_rotation(posture_now).T @ head_rotation(posture_before)
    in_optical = _OPTICAL_FROM_HEAD @ now_from_before @ _OPTICAL_FROM_HEAD.T
    return camera.matrix @ in_optical @ camera.inverse_matrix


def expected_image(
    before: NDArray[np.uint8], homography: NDArray[np.float64]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """The (H, W) image before as expected now, and a mask (H, W): 1 where it was in view."""
    height, width = before.shape
    if not _in_front(width, height, homography):
        return np.zeros_like(before), np.zeros_like(before)
    # Black, which the image itself is nowhere, comes in from beyond its borders.
    lit = cv2.max(before, 1)
    warped = cv2.warpPerspective(lit, homography, (width, height), flags=cv2.INTER_NEAREST)
    return warped, cv2.min(warped, 1)


def _in_front(width: int, height: int, homography: NDArray[np.float64]) -> bool:
    """Does the whole image before lie in front of the camera now?"""
    across, down, depth = homography[2].tolist()
    return depth + min(0.0, across * width) + min(0.0, down * height) > 1e-6
