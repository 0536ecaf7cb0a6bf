"""Detections on the wire: one row an object or face, see `Detection` for the fields."""

import math

import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from ja_common.core.detection import Detection, Kind
from ja_common.point_cloud_codec import decode_columns, encode_columns

FIELDS = (
    'x', 'y', 'z', 'u', 'v', 'width', 'height', 'kind', 'track_id', 'score',
    'f_col', 'f_edg', 'f_mot', 'attended',
)  # fmt: skip
SENSE_FIELDS = ('gaze_read', 'range_m', 'range_deviation_m')
"""Fields that other detectors and older recordings may lack: then nothing of it is known."""
_AS_THEY_ARE = [f for f in FIELDS if f not in ('z', 'kind', 'track_id', 'attended')]
_RANGE = ('range_m', 'range_deviation_m')


def encode_detections(header: Header, detections: list[Detection]) -> PointCloud2:
    """Return one message for one image; `header` is the image's own, unchanged."""
    names = (*FIELDS, *SENSE_FIELDS)
    return encode_columns(
        header,
        {f: [1.0 if f == 'z' else getattr(d, f) for d in detections] for f in names},
    )


def decode_detections(message: PointCloud2) -> list[Detection]:
    """Return the detections of a message.

    Raises ValueError when a field is missing, a number is not finite, the kind is unknown, or a
    range is neither NaN nor positive. The fields of `SENSE_FIELDS` may be missing.
    """
    present = {field.name for field in message.fields}
    senses = [name for name in SENSE_FIELDS if name in present]
    columns = decode_columns(message, (*FIELDS, *senses))
    if not all(np.isfinite(columns[name]).all() for name in columns if name not in _RANGE):
        raise ValueError('detections hold numbers that are not finite')
    ranges = [columns[name] for name in _RANGE if name in columns]
    if not all((np.isnan(each) | (np.isfinite(each) & (each > 0))).all() for each in ranges):
        raise ValueError('detections hold a range that is neither NaN nor a positive distance')
    count = message.width * message.height
    read = columns.get('gaze_read', np.zeros(count))
    # The one NaN of the library for each: detections that are equal compare as equal.
    range_m, deviation_m = (
        [math.nan if np.isnan(value) else float(value) for value in columns[name]]
        if name in columns
        else [math.nan] * count
        for name in _RANGE
    )
    return [
        Detection(
            kind=Kind(int(columns['kind'][i])),
            track_id=int(columns['track_id'][i]),
            attended=bool(columns['attended'][i]),
            gaze_read=bool(read[i]),
            range_m=range_m[i],
            range_deviation_m=deviation_m[i],
            **{name: float(columns[name][i]) for name in _AS_THEY_ARE},
        )
        for i in range(count)
    ]
