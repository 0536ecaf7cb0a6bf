"""Between ROS image messages and arrays: ``(H, W, 3)`` uint8 RGB inside, any encoding outside."""

import array
from collections.abc import Callable

import cv2
import numpy as np
from builtin_interfaces.msg import Time
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header

from ja_common.core.camera_model import CameraModel
from ja_common.core.picture_size import MOST_PIXELS, picture_size


class ImageError(ValueError):
    """An image message that cannot be turned into a picture; the text has the reason."""


_Decoder = Callable[[np.ndarray], np.ndarray]


def _convert(code: int) -> _Decoder:
    return lambda pixels: cv2.cvtColor(pixels, code)


def _convert_16(code: int) -> _Decoder:
    return lambda pixels: cv2.cvtColor(_high_byte(pixels), code)


def _high_byte(pixels: np.ndarray) -> np.ndarray:
    return (pixels >> 8).astype(np.uint8)


# encoding -> (bytes a sample, samples a pixel, conversion to RGB).
_ENCODINGS: dict[str, tuple[int, int, _Decoder]] = {
    'rgb8': (1, 3, lambda pixels: pixels),
    'bgr8': (1, 3, _convert(cv2.COLOR_BGR2RGB)),
    '8UC3': (1, 3, _convert(cv2.COLOR_BGR2RGB)),
    'rgba8': (1, 4, _convert(cv2.COLOR_RGBA2RGB)),
    'bgra8': (1, 4, _convert(cv2.COLOR_BGRA2RGB)),
    '8UC4': (1, 4, _convert(cv2.COLOR_BGRA2RGB)),
    'mono8': (1, 1, _convert(cv2.COLOR_GRAY2RGB)),
    '8UC1': (1, 1, _convert(cv2.COLOR_GRAY2RGB)),
    'rgb16': (2, 3, _high_byte),
    'bgr16': (2, 3, _convert_16(cv2.COLOR_BGR2RGB)),
    'mono16': (2, 1, _convert_16(cv2.COLOR_GRAY2RGB)),
    '16UC1': (2, 1, _convert_16(cv2.COLOR_GRAY2RGB)),
    # In ROS 'yuv422' is the older name of UYVY.
    'yuv422': (1, 2, _convert(cv2.COLOR_YUV2RGB_UYVY)),
    'uyvy': (1, 2, _convert(cv2.COLOR_YUV2RGB_UYVY)),
    'yuv422_yuy2': (1, 2, _convert(cv2.COLOR_YUV2RGB_YUY2)),
    'yuyv': (1, 2, _convert(cv2.COLOR_YUV2RGB_YUY2)),
    'bayer_rggb8': (1, 1, _convert(cv2.COLOR_BayerRGGB2RGB)),
    'bayer_bggr8': (1, 1, _convert(cv2.COLOR_BayerBGGR2RGB)),
    'bayer_gbrg8': (1, 1, _convert(cv2.COLOR_BayerGBRG2RGB)),
    'bayer_grbg8': (1, 1, _convert(cv2.COLOR_BayerGRBG2RGB)),
    'bayer_rggb16': (2, 1, _convert_16(cv2.COLOR_BayerRGGB2RGB)),
    'bayer_bggr16': (2, 1, _convert_16(cv2.COLOR_BayerBGGR2RGB)),
    'bayer_gbrg16': (2, 1, _convert_16(cv2.COLOR_BayerGBRG2RGB)),
    'bayer_grbg16': (2, 1, _convert_16(cv2.COLOR_BayerGRBG2RGB)),
}


def decode_image(msg: Image) -> np.ndarray:
    """Return the picture of ``msg`` as ``(H, W, 3)`` uint8 RGB.

    Row padding (``step``), big-endian samples and every encoding of common cameras are handled.
    16-bit samples keep their high byte. The array may share memory with ``msg``: do not write.

    Raises ``ImageError`` when the encoding is unknown or the sizes contradict each other.
    """
    if msg.encoding not in _ENCODINGS:
        raise ImageError(
            f"encoding '{msg.encoding}' is not supported (known: {', '.join(_ENCODINGS)})"
        )
    sample_bytes, samples, to_rgb = _ENCODINGS[msg.encoding]
    if msg.width == 0 or msg.height == 0:
        raise ImageError(f'the image has no pixels ({msg.width}x{msg.height})')
    if samples == 2 and msg.width % 2:
        raise ImageError(f"a '{msg.encoding}' image needs an even width, not {msg.width}")
    row_bytes = msg.width * samples * sample_bytes
    if msg.step < row_bytes:
        raise ImageError(
            f"step is {msg.step}, but a row of {msg.width} '{msg.encoding}' pixels "
            f'takes {row_bytes} bytes'
        )
    data = np.frombuffer(msg.data, np.uint8)
    # The last row may lack its padding: some drivers cut it off.
    needed = msg.step * (msg.height - 1) + row_bytes
    if data.size < needed:
        raise ImageError(
            f"{data.size} bytes of data, but {msg.width}x{msg.height} '{msg.encoding}' "
            f'with step {msg.step} takes {needed}'
        )
    pixels = np.lib.stride_tricks.as_strided(
        data, (msg.height, row_bytes), (msg.step, 1), writeable=False
    )
    if sample_bytes == 2:
        order = '>u2' if msg.is_bigendian else '<u2'
        pixels = np.ascontiguousarray(pixels).view(order).astype(np.uint16, copy=False)
    if samples > 1:
        pixels = np.ascontiguousarray(pixels).reshape(msg.height, msg.width, samples)
    try:
        return to_rgb(np.ascontiguousarray(pixels))
    except cv2.error as error:
        raise ImageError(
            f"{msg.width}x{msg.height} '{msg.encoding}' cannot be converted: {error.err}"
        ) from error


def decode_compressed(msg: CompressedImage) -> np.ndarray:
    """Return the picture of a JPEG or PNG message as ``(H, W, 3)`` uint8 RGB.

    Raises ``ImageError`` when the data is no picture.
    """
    data = np.frombuffer(msg.data, np.uint8)
    size = picture_size(data.data) if data.size else None
    if size is not None and size[0] * size[1] > MOST_PIXELS:
        raise ImageError(f'a picture of {size[0]}x{size[1]} is larger than {MOST_PIXELS} pixels')
    # No other format is decoded. IMREAD_COLOR_RGB also reduces grey, alpha and 16-bit PNG to RGB.
    picture = None if size is None else cv2.imdecode(data, cv2.IMREAD_COLOR_RGB)
    if picture is None:
        raise ImageError(f"{data.size} bytes of format '{msg.format}' are no readable picture")
    return picture


def encode_image(pixels: np.ndarray, stamp: Time, frame_id: str) -> Image:
    """Pack ``(H, W, 3)`` uint8 RGB as rgb8, or ``(H, W)`` uint8 as mono8.

    Raises ``ImageError`` for any other shape or type.
    """
    colour = pixels.ndim == 3 and pixels.shape[2] == 3
    if pixels.dtype != np.uint8 or not (colour or pixels.ndim == 2):
        raise ImageError(
            f'an image is (H, W, 3) or (H, W) uint8, not {pixels.shape} {pixels.dtype}'
        )
    msg = Image()
    msg.header.stamp = stamp
    msg.header.frame_id = frame_id
    msg.height, msg.width = pixels.shape[:2]
    msg.encoding = 'rgb8' if colour else 'mono8'
    msg.step = msg.width * (3 if colour else 1)
    # Assigning an array.array is taken over whole; an ndarray would be copied element by element.
    data = array.array('B')
    data.frombytes(np.ascontiguousarray(pixels).data.cast('B'))
    msg.data = data
    return msg


def encode_camera_info(
    header: Header, width: int, height: int, fx: float, fy: float | None = None
) -> CameraInfo:
    """Return the calibration of an ideal camera: axis through the centre, no distortion.

    `fx`, `fy`: focal lengths [px]; the pixels are square where only one is given.
    """
    fy = fx if fy is None else fy
    cx, cy = (width - 1) / 2, (height - 1) / 2
    info = CameraInfo(header=header, width=width, height=height)
    info.distortion_model, info.d = 'plumb_bob', [0.0] * 5
    info.k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    info.r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    info.p = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    return info


def decode_camera_info(info: CameraInfo | None, width: int, height: int) -> CameraModel | None:
    """Return the camera for images of `width` x `height` [px]; None where it is not calibrated.

    A calibration for images of another size is scaled. Raises ValueError when its focal lengths
    are not positive and finite.
    """
    if info is None:
        return None
    camera = CameraModel.from_calibration(
        info.width or width, info.height or height, info.k, info.d
    )
    return None if camera is None else camera.resized(width, height)
