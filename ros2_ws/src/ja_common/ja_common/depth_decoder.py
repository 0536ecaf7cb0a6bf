"""From ROS depth images to samples of depth (REP-118)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import Image

from ja_common.core.image_encodings import ImageError, RawImage

# By encoding: type of a sample, and how many metres it counts. mono16 is what some drivers write.
_SAMPLES = {'16uc1': ('u2', 0.001), 'mono16': ('u2', 0.001), '32fc1': ('f4', 1.0)}


def decode_depth(message: Image) -> tuple[NDArray[Any], float]:
    """Return the samples (H, W) of a depth image, and what they are multiplied by for metres.

    uint16 or float32 of either byte order. Where nothing was measured they hold 0 or NaN. Row
    padding (``step``) is left out.

    Raises ``ImageError`` when the encoding is no depth or the sizes contradict each other.
    """
    encoding = message.encoding.strip().lower()
    if encoding not in _SAMPLES:
        raise ImageError(
            f"encoding '{message.encoding[:40]}' is no depth: it must be 16UC1 [mm] or 32FC1 [m] "
            '(REP-118)'
        )
    if message.width == 0 or message.height == 0:
        raise ImageError(f'the depth image has no pixels ({message.width}x{message.height})')
    kind, unit_m = _SAMPLES[encoding]
    big_endian = bool(message.is_bigendian)
    dtype = np.dtype(f'{">" if big_endian else "<"}{kind}')
    row_bytes = message.width * dtype.itemsize
    if message.step < row_bytes:
        raise ImageError(
            f'step is {message.step}, but a row of {message.width} depths takes {row_bytes} bytes'
        )
    data = np.frombuffer(message.data, np.uint8)
    raw = RawImage(data, message.encoding, message.width, message.height, message.step, big_endian)
    return raw.rows(0, message.height, row_bytes, message.step).view(dtype), unit_m
