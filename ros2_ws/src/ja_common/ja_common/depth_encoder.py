"""Depth pictures as ROS image messages (REP-118)."""

import array

import numpy as np
from builtin_interfaces.msg import Time
from numpy.typing import NDArray
from sensor_msgs.msg import Image

DEPTH_ENCODINGS = ('16UC1', '32FC1')
"""Whole millimetres, 0 where nothing was measured; metres, NaN where nothing was measured."""
_MOST_MM = np.iinfo(np.uint16).max


def encode_depth(depth: NDArray[np.floating], encoding: str, stamp: Time, frame_id: str) -> Image:
    """Pack depths (H, W) [m], NaN where unknown, in one of `DEPTH_ENCODINGS`.

    In 16UC1, depths of 65.5 m and more are unknown. Raises ValueError for another encoding, or an
    array that is not (H, W).
    """
    if encoding not in DEPTH_ENCODINGS:
        known = ' or '.join(DEPTH_ENCODINGS)
        raise ValueError(f'a depth picture is encoded as {known}, not as {encoding[:40]!r}')
    if depth.ndim != 2:
        raise ValueError(f'a depth picture is (H, W), not {depth.shape}')
    samples = depth.astype('<f4')
    if encoding == '16UC1':
        known_mm = np.nan_to_num(np.rint(1000.0 * samples), nan=0.0, posinf=0.0, neginf=0.0)
        known_mm[(known_mm < 0) | (known_mm > _MOST_MM)] = 0.0
        samples = known_mm.astype('<u2')
    message = Image()
    message.header.stamp, message.header.frame_id = stamp, frame_id
    message.height, message.width = samples.shape
    message.encoding, message.step = encoding, samples.shape[1] * samples.itemsize
    # Assigning an array.array is taken over whole; an ndarray would be copied element by element.
    data = array.array('B')
    data.frombytes(np.ascontiguousarray(samples).data.cast('B'))
    message.data = data
    return message
