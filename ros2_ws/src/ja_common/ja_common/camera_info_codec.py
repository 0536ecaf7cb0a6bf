"""Between sensor_msgs/CameraInfo and a camera model."""

from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from ja_common.core.camera_calibration import CameraCalibration
from ja_common.core.camera_model import CameraModel


def encode_camera_info(
    header: Header,
    width: int,
    height: int,
    fx: float,
    fy: float | None = None,
    baseline_m: float = 0.0,
) -> CameraInfo:
    """Return the calibration of an ideal camera: axis through the centre, no distortion.

    `fx`, `fy`: focal lengths [px]; the pixels are square where only one is given. `baseline_m`:
    how far this camera stands to the right of the one that it is paired with.
    """
    fy = fx if fy is None else fy
    cx, cy = (width - 1) / 2, (height - 1) / 2
    info = CameraInfo(header=header, width=width, height=height)
    info.distortion_model, info.d = 'plumb_bob', [0.0] * 5
    info.k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    info.r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    info.p = [fx, 0.0, cx, 0.0 - fx * baseline_m, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    return info


def decode_calibration(info: CameraInfo) -> CameraCalibration:
    """Return the numbers of a message."""
    roi = info.roi
    return CameraCalibration(
        k=tuple(map(float, info.k)),
        d=tuple(map(float, info.d)),
        model=info.distortion_model,
        p=tuple(map(float, info.p)),
        size=(info.width, info.height),
        binning=(info.binning_x, info.binning_y),
        roi=(roi.x_offset, roi.y_offset, roi.width, roi.height),
    )


def decode_camera_info(
    info: CameraInfo | None, width: int, height: int, rectified: bool = False
) -> CameraModel | None:
    """Return the camera of images of `width` x `height` [px]; None where it is not calibrated.

    A calibration for images of another size is scaled. Raises ValueError as
    `CameraCalibration.camera`.
    """
    return None if info is None else decode_calibration(info).camera(width, height, rectified)
