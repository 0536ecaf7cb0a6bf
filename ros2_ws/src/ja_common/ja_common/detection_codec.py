"""Detections on the wire: one row an object or face, see `Detection` for the fields."""

import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from ja_common.core.detection import Detection, Kind
from ja_common.point_cloud_codec import decode_columns, encode_columns

FIELDS = (
    'x', 'y', 'z', 'u', 'v', 'width', 'height', 'kind', 'track_id', 'score',
    'f_col', 'f_edg', 'f_mot', 'attended',
)  # fmt: skip
_AS_THEY_ARE = [f for f in FIELDS if f not in ('z', 'kind', 'track_id', 'attended')]


def encode_detections(header: Header, detections: list[Detection]) -> PointCloud2:
    """Return one message for one image; `header` is the image's own, unchanged."""
    return encode_columns(
        header,
        {f: [1.0 if f == 'z' else getattr(d, f) for d in detections] for f in FIELDS},
    )


def decode_detections(message: PointCloud2) -> list[Detection]:
    """Return the detections of a message.

    Raises ValueError when a field is missing, a number is not finite, or the kind is unknown.
    """
    columns = decode_columns(message, FIELDS)
    if not all(np.isfinite(column).all() for column in columns.values()):
        raise ValueError('detections hold numbers that are not finite')
    return [
        Detection(
            kind=Kind(int(columns['kind'][i])),
            track_id=int(columns['track_id'][i]),
            attended=bool(columns['attended'][i]),
            **{name: float(columns[name][i]) for name in _AS_THEY_ARE},
        )
        for i in range(message.width * message.height)
    ]
