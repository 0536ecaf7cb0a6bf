"""Detections on the wire: sensor_msgs/PointCloud2, all float32, fields by name."""

import array

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from ja_common.core.detection import Detection, Kind

FIELDS = (
    'x', 'y', 'z', 'u', 'v', 'width', 'height', 'kind', 'track_id', 'score',
    'f_col', 'f_edg', 'f_mot', 'attended',
)  # fmt: skip
_POINT_FIELDS = [
    PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1)
    for i, name in enumerate(FIELDS)
]


def encode_detections(header: Header, detections: list[Detection]) -> PointCloud2:
    """One message for one image; `header` is the image's own, unchanged."""
    rows = np.array(
        [[1.0 if f == 'z' else float(getattr(d, f)) for f in FIELDS] for d in detections],
        np.float32,
    )
    return PointCloud2(
        header=header,
        height=1,
        width=len(detections),
        fields=_POINT_FIELDS,
        is_bigendian=False,
        point_step=4 * len(FIELDS),
        row_step=4 * len(FIELDS) * len(detections),
        data=array.array('B', rows.tobytes()),
        is_dense=True,
    )


def decode_detections(message: PointCloud2) -> list[Detection]:
    """Detections of a message, whatever the order of its fields and however many more it has.

    Raises ValueError when a field is missing or not float32, or when the data's size does not fit.
    """
    columns = decode_columns(message, FIELDS)
    if not np.isfinite(list(columns.values())).all():
        raise ValueError('detections hold numbers that are not finite')
    try:
        kinds = [Kind(int(k)) for k in columns['kind']]
    except ValueError as error:
        raise ValueError(f'detections: {error}') from None
    return [
        Detection(
            kind=kinds[i],
            track_id=int(columns['track_id'][i]),
            attended=bool(columns['attended'][i]),
            **{
                name: float(columns[name][i])
                for name in FIELDS
                if name not in ('z', 'kind', 'track_id', 'attended')
            },
        )
        for i in range(len(kinds))
    ]


def decode_columns(message: PointCloud2, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Named float32 columns, shape (n,), of any PointCloud2. Raises ValueError if one lacks."""
    points = message.width * message.height
    fields = {field.name: field for field in message.fields}
    lacking = [name for name in names if name not in fields]
    if lacking:
        raise ValueError(f'point cloud lacks the fields {lacking}; it has {sorted(fields)}')
    order = '>' if message.is_bigendian else '<'
    if not points:
        return {name: np.empty(0, np.float32) for name in names}
    if message.point_step * points != len(message.data):
        raise ValueError(
            f'point cloud of {points} points of {message.point_step} bytes holds '
            f'{len(message.data)} bytes of data'
        )
    raw = np.frombuffer(message.data, np.uint8).reshape(points, message.point_step)
    columns = {}
    for name in names:
        field = fields[name]
        if field.datatype != PointField.FLOAT32 or field.offset + 4 > message.point_step:
            raise ValueError(f'field {name!r} of the point cloud is not a float32 inside a point')
        column = np.ascontiguousarray(raw[:, field.offset : field.offset + 4])
        columns[name] = column.view(order + 'f4').reshape(points).astype(np.float32)
    return columns
