"""Detections on the wire, and tables of any writer."""

import array

import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from ja_common.core.detection import Detection, Kind
from ja_common.detection_codec import FIELDS, SENSE_FIELDS, decode_detections, encode_detections
from ja_common.point_cloud_codec import decode_columns, encode_columns
from node_bench import header

FACE = Detection(Kind.FACE, -0.25, 0.125, 80, 60, 40, 48, 0.5, track_id=3, attended=True)
BALL = Detection(
    Kind.OBJECT, 0.5, -0.75, 200, 30, 20, 20, 0.75, track_id=17, f_col=1.0, f_edg=0.5, f_mot=0.25
)


def test_there_and_back_with_the_header_unchanged():
    message = encode_detections(header(1_234_567_890_123), [FACE, BALL])
    assert decode_detections(message) == [FACE, BALL]
    assert message.header == header(1_234_567_890_123)


def test_any_tool_reads_the_points():
    message = encode_detections(Header(), [FACE, BALL])
    assert [field.name for field in message.fields] == [*FIELDS, *SENSE_FIELDS]
    assert {field.datatype for field in message.fields} == {PointField.FLOAT32}
    assert (message.height, message.width, message.row_step) == (1, 2, 2 * message.point_step)
    x, y, z = np.frombuffer(message.data, '<f4').reshape(2, -1)[1, :3]
    assert (x, y, z) == (0.5, -0.75, 1.0)


def test_nothing_seen_is_a_message_too():
    message = encode_detections(Header(), [])
    assert message.width == 0
    assert [field.name for field in message.fields] == [*FIELDS, *SENSE_FIELDS]
    assert decode_detections(message) == []


def test_numbers_that_are_not_finite_are_refused():
    message = encode_detections(Header(), [Detection(Kind.OBJECT, np.nan, 0, 0, 0, 1, 1, 1)])
    with pytest.raises(ValueError, match='not finite'):
        decode_detections(message)


def test_unknown_kind_is_refused():
    columns = {name: [0.0] for name in FIELDS} | {'kind': [5.0]}
    with pytest.raises(ValueError, match='5 is not a valid Kind'):
        decode_detections(encode_columns(Header(), columns))


def test_missing_column_is_named():
    with pytest.raises(ValueError, match=r"lacks the fields \['z'\]; it has \['x', 'y'\]"):
        decode_columns(encode_columns(Header(), {'x': [1.0], 'y': [2.0]}), ['x', 'z'])


def test_foreign_cloud_with_another_layout():
    """Big-endian, two rows of points, padding, a column of another type."""
    point = np.dtype({'names': ['t', 'b', 'a'], 'formats': ['>u2', '>f4', '>f4'],
                      'offsets': [0, 4, 8], 'itemsize': 16})  # fmt: skip
    points = np.zeros(4, point)
    points['a'], points['b'] = [1, 2, 3, 4], [5, 6, 7, 8]
    message = PointCloud2(
        height=2, width=2, is_bigendian=True, point_step=16, row_step=32,
        fields=[
            PointField(name='t', offset=0, datatype=PointField.UINT16, count=1),
            PointField(name='b', offset=4, datatype=PointField.FLOAT32, count=1),
            PointField(name='a', offset=8, datatype=PointField.FLOAT32, count=1),
        ],
        data=array.array('B', points.tobytes()),
    )  # fmt: skip
    columns = decode_columns(message, ['a', 'b'])
    assert columns['a'].tolist() == [1, 2, 3, 4]
    assert columns['b'].tolist() == [5, 6, 7, 8]
    with pytest.raises(ValueError, match=r"'t' .* is not a float32"):
        decode_columns(message, ['t'])


def broken(**fields):
    message = encode_columns(Header(), {'a': [1.0, 2.0]})
    for name, value in fields.items():
        setattr(message, name, value)
    return message


@pytest.mark.parametrize(
    ('message', 'text'),
    [
        (broken(data=array.array('B')), '2 points of 4 bytes holds 0 bytes'),
        (broken(width=2**31), 'bytes of data'),
        (broken(point_step=3), 'bytes of data'),
        (broken(point_step=2, width=4), 'not a float32 inside a point'),
        (
            broken(fields=[PointField(name='a', offset=2, datatype=PointField.FLOAT32)]),
            'not a float32 inside a point',
        ),
    ],
)
def test_size_that_does_not_fit_is_refused(message, text):
    with pytest.raises(ValueError, match=text):
        decode_columns(message, ['a'])
