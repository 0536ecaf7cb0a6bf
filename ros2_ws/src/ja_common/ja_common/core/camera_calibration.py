"""The camera that a calibration describes: sensor_msgs/CameraInfo as plain numbers.

All that changes the geometry is obeyed (K, D, P, binning, roi) or refused with the reason.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ja_common.core.camera_model import CameraModel
from ja_common.core.lens import Lens

_BROWN = ('plumb_bob', 'rational_polynomial', 'thin_prism')
_FISHEYE = ('equidistant', 'fisheye', 'kannala_brandt', 'kannala_brandt4')
_STRAIGHT = ('', 'none', 'pinhole')
_BROWN_LENGTHS = (4, 5, 8, 12, 14)
# Images may differ from a scaled calibration by rounding, not by another shape.
_ROUNDING = 0.01


@dataclass(frozen=True)
class CameraCalibration:
    """A calibration as ROS writes it: for the full sensor, before ``roi`` and ``binning``.

    ``size``: (width, height) [px], 0 where it is that of the images. ``k``: 3x3 and ``p``: 3x4,
    row-major. ``roi``: (x_offset, y_offset, width, height), all 0 for the full image.
    """

    k: Sequence[float]
    d: Sequence[float] = ()
    model: str = 'plumb_bob'
    p: Sequence[float] = (0.0,) * 12
    size: tuple[int, int] = (0, 0)
    binning: tuple[int, int] = (1, 1)
    roi: tuple[int, int, int, int] = (0, 0, 0, 0)

    def camera(self, width: int, height: int, rectified: bool = False) -> CameraModel | None:
        """Return the camera of images of this size [px]; None where K and P are zero.

        ``rectified``: the images are without distortion, as of `image_rect`; P holds for them.
        Raises ``ValueError`` where the calibration contradicts itself or the images.
        """
        camera = self._full_camera(width, height, rectified)
        return None if camera is None else self._fit(camera, width, height)

    def full_view(self, rectified: bool = False) -> CameraModel | None:
        """Return the camera of images of the calibrated size; None where that is not known.

        Raises ``ValueError`` as ``camera``.
        """
        camera = self._full_camera(*self.size, rectified) if all(self.size) else None
        return None if camera is None else self._window(camera)

    def check(self, rectified: bool = False) -> bool:
        """Return whether the camera is calibrated. Raises ``ValueError`` as ``camera``."""
        width, height = self.size
        camera = self._full_camera(width or 1, height or 1, rectified)
        if camera is not None and all(self.size):
            self._window(camera)
        return camera is not None

    def _full_camera(self, width: int, height: int, rectified: bool) -> CameraModel | None:
        width, height = self.size[0] or width, self.size[1] or height
        p_3x3 = [self.p[i] for i in (0, 1, 2, 4, 5, 6, 8, 9, 10)]
        if not any(self.k) and not any(p_3x3):
            return None
        lens = self._lens()
        if rectified and any(p_3x3):
            name, matrix, lens = 'P', p_3x3, None
        elif any(self.k):
            name, matrix = 'K', list(self.k)
        else:
            # P alone: it holds for images without distortion only.
            name, matrix = 'P', p_3x3
        if lens is not None and (rectified or name == 'P'):
            raise ValueError(
                f'the camera has lens distortion (D), but {"P" if name == "K" else "K"} is zero: '
                'calibrate it again, with ros-jazzy-camera-calibration for example'
            )
        return CameraModel(width, height, *_intrinsics(name, matrix, self.model), lens=lens,
                           skew=(matrix[1], 0.0))  # fmt: skip

    def _lens(self) -> Lens | None:
        """Return the lens of the distortion model and D; None where nothing is distorted."""
        model, d = self.model.strip().lower(), tuple(self.d)
        if not all(math.isfinite(value) for value in d):
            raise ValueError(f'D = {_shown(d)} holds numbers that are not finite')
        if model in _FISHEYE:
            if len(d) < 4 or any(d[4:]):
                raise ValueError(
                    f"the distortion model '{model}' needs 4 numbers in D, not {len(d)}"
                )
            return Lens(d[:4], fisheye=True)
        if model not in _BROWN + _STRAIGHT:
            known = ', '.join((*_BROWN, _FISHEYE[0]))
            raise ValueError(
                f"the distortion model '{self.model[:40]}' is not known ({known} are): calibrate "
                'with one of these, or use the rectified images (image_rect) of image_proc'
            )
        if not any(d):
            return None
        if model in _STRAIGHT and len(d) == 4:
            raise ValueError(
                f"the distortion model is '{model}', but D holds 4 numbers, which plumb_bob and "
                'equidistant read differently: set distortion_model to one of them'
            )
        if len(d) not in _BROWN_LENGTHS:
            raise ValueError(
                f"D holds {len(d)} numbers; '{model or 'plumb_bob'}' needs 4, 5, 8, 12 or 14"
            )
        return Lens(d)

    def _window(self, camera: CameraModel) -> CameraModel:
        """Return the camera of the part of the sensor that is read out (roi)."""
        left, top, width, height = self.roi
        if not any(self.roi) or self.roi == (0, 0, camera.width, camera.height):
            return camera
        outside = left + width > camera.width or top + height > camera.height
        if not (width and height) or outside:
            raise ValueError(
                f'roi is {width}x{height} at ({left}, {top}), which is no part of '
                f'{camera.width}x{camera.height}: correct the camera driver'
            )
        return camera.cropped(left, top, width, height)

    def _fit(self, camera: CameraModel, width: int, height: int) -> CameraModel:
        """Return the camera for images of a size, which must be its window, scaled."""
        window = self._window(camera)
        across, down = width / window.width, height / window.height
        binning_x, binning_y = (max(1, b) for b in self.binning)
        if window is not camera and (width, height) == (
            camera.width // binning_x, camera.height // binning_y
        ):  # fmt: skip
            raise ValueError(
                f'the images are {width}x{height}, the full size, but camera_info has a window '
                f'(roi) of {window.width}x{window.height}: correct the camera driver'
            )
        if not (
            _alike(across, down, window, (1, 1))
            or _alike(across * binning_x, down * binning_y, window, (binning_x, binning_y))
        ):
            raise ValueError(
                f'the images are {width}x{height}, but camera_info is for '
                f'{window.width}x{window.height}: another shape, so which part of the view they '
                'show is not known; calibrate the camera at the size of its images'
            )
        return window.resized(width, height)


def _alike(across: float, down: float, window: CameraModel, binning: tuple[int, int]) -> bool:
    """Return whether two scales agree, but for the rounding of the images to whole pixels."""
    rounding = max(
        _ROUNDING * max(across, down), binning[0] / window.width, binning[1] / window.height
    )
    return abs(across - down) <= rounding


def _intrinsics(name: str, m: Sequence[float], model: str) -> tuple[float, float, float, float]:
    """Return fx, fy, cx, cy of a row-major 3x3 matrix. Raises ``ValueError``."""
    fx, fy, cx, cy = m[0], m[4], m[2], m[5]
    if not (all(math.isfinite(value) for value in m) and min(fx, fy) > 0):
        raise ValueError(
            f'focal lengths must be positive, and {name} finite: fx={fx:g} fy={fy:g} '
            f'cx={cx:g} cy={cy:g}'
        )
    if m[3] or m[6] or m[7] or m[8] not in (0.0, 1.0):
        raise ValueError(
            f'{name} = {_shown(m)} is no camera matrix (fx 0 cx, 0 fy cy, 0 0 1, row by row)'
        )
    return fx, fy, cx, cy


def _shown(numbers: Sequence[float]) -> str:
    return '[' + ', '.join(f'{number:g}' for number in numbers[:14]) + ']'
