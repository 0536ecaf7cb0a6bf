"""Point clouds of the graph as far as they can be drawn: not too many points, all finite."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2

from ja_common.core.detection import Detection
from ja_common.detection_codec import decode_detections
from ja_common.point_cloud_codec import decode_columns

_MOST_POINTS = 2000


def shown_detections(message: PointCloud2) -> list[Detection]:
    """Return the detections of a message.

    Raises ValueError as `decode_detections`, and for too many of them.
    """
    _check_count(message)
    return decode_detections(message)


def finite_columns(message: PointCloud2, names: Sequence[str]) -> dict[str, NDArray[np.float32]]:
    """Decode columns of a cloud that can be drawn.

    Raises ValueError as `decode_columns`, for numbers that are not finite, and for many points.
    """
    _check_count(message)
    columns = decode_columns(message, names)
    if not all(np.isfinite(column).all() for column in columns.values()):
        raise ValueError('the point cloud holds numbers that are not finite')
    return columns


def _check_count(message: PointCloud2) -> None:
    count = message.width * message.height
    if count > _MOST_POINTS:
        raise ValueError(f'a viewer gets up to {_MOST_POINTS} points, not {count}')
