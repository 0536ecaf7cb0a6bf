"""Images without lens distortion, and masks with it."""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel

Maps = tuple[NDArray, NDArray]


def undistort_image(image: NDArray[np.uint8], camera: CameraModel) -> NDArray[np.uint8]:
    """Return an (H, W) image without the lens distortion of ``camera``."""
    if not camera.distortion:
        return image
    return cv2.remap(image, *_straight_from_bent(camera), cv2.INTER_LINEAR)


def distort_mask(mask: NDArray[np.uint8], camera: CameraModel) -> NDArray[np.uint8]:
    """Return an (H, W) mask of the undistorted image in pixels of the original."""
    if not camera.distortion:
        return mask
    return cv2.remap(mask, *_bent_from_straight(camera), cv2.INTER_NEAREST)


@lru_cache(maxsize=4)
def _straight_from_bent(camera: CameraModel) -> Maps:
    size = (camera.width, camera.height)
    distortion = np.array(camera.distortion)
    return cv2.initUndistortRectifyMap(
        camera.matrix, distortion, None, camera.matrix, size, cv2.CV_16SC2
    )


@lru_cache(maxsize=4)
def _bent_from_straight(camera: CameraModel) -> Maps:
    columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = camera.rays(np.stack([columns, rows], axis=-1))
    straight = rays * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    return cv2.convertMaps(
        straight[..., 0].astype(np.float32), straight[..., 1].astype(np.float32), cv2.CV_16SC2
    )
