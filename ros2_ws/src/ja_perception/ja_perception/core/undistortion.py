"""Images without lens distortion, and masks with it."""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel

Maps = tuple[NDArray, NDArray]
_FARTHEST_PX = 30_000.0


def undistort_image(image: NDArray[np.uint8], camera: CameraModel) -> NDArray[np.uint8]:
    """Return an (H, W) image without the lens distortion of ``camera``."""
    if camera.lens is None:
        return image
    return cv2.remap(image, *_straight_from_bent(camera), cv2.INTER_LINEAR)


def distort_mask(mask: NDArray[np.uint8], camera: CameraModel) -> NDArray[np.uint8]:
    """Return an (H, W) mask of the undistorted image in pixels of the original."""
    if camera.lens is None:
        return mask
    return cv2.remap(mask, *_bent_from_straight(camera), cv2.INTER_NEAREST)


@lru_cache(maxsize=4)
def _straight_from_bent(camera: CameraModel) -> Maps:
    pixels = _every_pixel(camera)
    straight = (pixels - (camera.cx, camera.cy)) @ camera.inverse_matrix[:2, :2].T
    return _maps(camera.pixels(straight))


@lru_cache(maxsize=4)
def _bent_from_straight(camera: CameraModel) -> Maps:
    return _maps(camera.straight_pixels(camera.rays(_every_pixel(camera))))


def _every_pixel(camera: CameraModel) -> NDArray[np.float64]:
    """Return the pixels (u, v) of an image, shape (H, W, 2)."""
    columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    return np.stack([columns, rows], axis=-1).astype(float)


def _maps(pixels: NDArray[np.float64]) -> Maps:
    # OpenCV's maps hold 16 bits; what lies so far outside of the image is black in any case.
    near = np.clip(pixels, -_FARTHEST_PX, _FARTHEST_PX).astype(np.float32)
    return cv2.convertMaps(near[..., 0], near[..., 1], cv2.CV_16SC2)
