"""Between ROS image messages and arrays: ``(H, W, 3)`` uint8 RGB inside, any encoding outside."""

import array

import cv2
import numpy as np
from builtin_interfaces.msg import Time
from sensor_msgs.msg import CompressedImage, Image

from ja_common.core.image_encodings import ImageError, RawImage, decode_raw, demosaic
from ja_common.core.picture_size import MOST_PIXELS, is_cut_off, picture_size
from ja_common.core.sample_depth import SampleDepth

_COLOUR = cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH
_VIDEO = ('h264', 'h265', 'hevc', 'av1', 'vp8', 'vp9', 'ffmpeg', 'theora')


def decode_image(msg: Image, depth: SampleDepth | None = None) -> np.ndarray:
    """Return the picture of ``msg`` as ``(H, W, 3)`` uint8 RGB.

    Row padding (``step``), big-endian samples and every encoding of common cameras are handled.
    16-bit samples keep their high byte, or follow ``depth``. The array may share memory with
    ``msg``: do not write.

    Raises ``ImageError`` when the encoding is unknown or the sizes contradict each other.
    """
    data = np.frombuffer(msg.data, np.uint8)
    raw = RawImage(
        data, msg.encoding, msg.width, msg.height, msg.step, bool(msg.is_bigendian)
    )  # fmt: skip
    return decode_raw(raw, depth or SampleDepth(16))


def decode_compressed(msg: CompressedImage, depth: SampleDepth | None = None) -> np.ndarray:
    """Return the picture of a JPEG or PNG message as ``(H, W, 3)`` uint8 RGB.

    ``format`` is that of image_transport: 'jpeg', 'rgb8; jpeg compressed bgr8'. It states whether
    the picture is a Bayer mosaic, or holds red and blue in the other order.

    Raises ``ImageError`` when the data is no picture.
    """
    layout, _, compression = msg.format.lower().partition(';')
    if 'compresseddepth' in msg.format.lower():
        raise ImageError(
            f"format '{msg.format[:60]}' holds distances, no picture: remap image_raw/compressed "
            'to the colour image of the camera'
        )
    if layout.strip().startswith(_VIDEO) or compression.strip().startswith(_VIDEO):
        raise ImageError(
            f"format '{msg.format[:60]}' is a stream of video, not of pictures: let "
            'image_transport republish it as raw or jpeg'
        )
    data = np.frombuffer(msg.data, np.uint8)
    size = picture_size(data.data) if data.size else None
    if size is not None and size[0] * size[1] > MOST_PIXELS:
        raise ImageError(f'a picture of {size[0]}x{size[1]} is larger than {MOST_PIXELS} pixels')
    if size is not None and is_cut_off(data.data):
        raise ImageError(
            f'the picture ends early, after {data.size} bytes: the driver or the network cut it'
        )
    # No other format is decoded. IMREAD_COLOR also reduces grey and alpha to three channels.
    bgr = None if size is None else cv2.imdecode(data, _COLOUR)
    if bgr is None:
        raise ImageError(
            f"{data.size} bytes of format '{msg.format[:60]}' are no readable picture"
        )
    if bgr.dtype == np.uint16:
        bgr = (depth or SampleDepth(16)).to_8_bits(bgr)
    if layout.startswith('bayer_') and np.array_equal(bgr[..., 0], bgr[..., 2]):
        return demosaic(np.ascontiguousarray(bgr[..., 0]), layout)
    if 'compressed rgb' in compression:
        return bgr  # the sender gave RGB to an encoder for BGR
    return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)


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
