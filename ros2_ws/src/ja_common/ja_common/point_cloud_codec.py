"""Tables on the wire: sensor_msgs/PointCloud2 with named float32 columns."""

import array
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header


def encode_columns(header: Header, columns: Mapping[str, ArrayLike]) -> PointCloud2:
    """Return a message whose points are the rows of the columns, each (n,), as float32."""
    table = np.array([*columns.values()], '<f4').T
    return PointCloud2(
        header=header,
        height=1,
        width=len(table),
        fields=[
            PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1)
            for i, name in enumerate(columns)
        ],
        is_bigendian=False,
        point_step=4 * len(columns),
        row_step=table.nbytes,
        data=array.array('B', table.tobytes()),
        is_dense=True,
    )


def decode_columns(message: PointCloud2, names: Sequence[str]) -> dict[str, NDArray[np.float32]]:
    """Return the named columns, each (n,), of a message with its fields in any order.

    Raises ValueError when a column is missing or not float32, or the data's size does not fit.
    """
    points = message.width * message.height
    fields = {field.name: field for field in message.fields}
    lacking = [name for name in names if name not in fields]
    if lacking:
        raise ValueError(f'the point cloud lacks the fields {lacking}; it has {sorted(fields)}')
    if message.point_step * points != len(message.data):
        raise ValueError(
            f'a point cloud of {points} points of {message.point_step} bytes holds '
            f'{len(message.data)} bytes of data'
        )
    for name in names:
        field = fields[name]
        if field.datatype != PointField.FLOAT32 or field.offset + 4 > message.point_step:
            raise ValueError(f'field {name!r} of the point cloud is not a float32 inside a point')
    layout = np.dtype(
        {
            'names': names,
            'formats': ['>f4' if message.is_bigendian else '<f4'] * len(names),
            'offsets': [fields[name].offset for name in names],
            'itemsize': message.point_step,
        }
    )
    table = np.frombuffer(message.data, layout)
    return {name: table[name].astype(np.float32) for name in names}
