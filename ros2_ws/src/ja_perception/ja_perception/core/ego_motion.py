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
    return camera.matrix @ in_optical @ np.linalg.inv(camera.matrix)


def expected_image(
    before: NDArray[np.uint8], homography: NDArray[np.float64]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """The (H, W) image before as expected now, and a mask (H, W): 1 where it was in view."""
    height, width = before.shape
    size = (width, height)
    # Repeated borders: a blur near them must not mix in what never was there.
    warped = cv2.warpPerspective(before, homography, size, borderMode=cv2.BORDER_REPLICATE)
    seen = np.zeros_like(before)
    corners = np.array(
        [[[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]]]
    )
    outline = cv2.perspectiveTransform(corners, homography)
    if _in_front(corners, homography):
        # Fixed-point corners (4 bits), shrunk by the pixel that interpolation cannot fill.
        cv2.fillConvexPoly(seen, np.round(outline * 16).astype(np.int32), 1, shift=4)
        seen = cv2.erode(seen, np.ones((3, 3), np.uint8))
    return warped, seen


def _in_front(corners: NDArray[np.float64], homography: NDArray[np.float64]) -> bool:
    """Does the whole image before lie in front of the camera now?"""
    return bool(np.all(corners.reshape(-1, 2) @ homography[2, :2] + homography[2, 2] > 1e-6))
