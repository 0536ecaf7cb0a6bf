"""Messages that a node must survive, of any type: malformed, foreign, extreme and garbled ones."""

import array
import math
import random
import re
from collections.abc import Callable
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.serialization import serialize_message
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState, PointCloud2
from std_msgs.msg import Float64MultiArray, Header, String

from ja_common.camera_info_codec import encode_camera_info
from ja_common.core.detection import Detection, Kind
from ja_common.detection_codec import encode_detections
from ja_common.face_gaze_codec import FIELDS as GAZE
from ja_common.image_codec import encode_image
from ja_common.message_types import message_class
from ja_common.point_cloud_codec import encode_columns

NUMBERS = (0.0, 1.0, -1.0, 1e-300, 1e30, 1e300, float('nan'), float('inf'), float('-inf'))
INTEGERS = {
    f'{sign}int{bits}': (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for bits in (8, 16, 32, 64)
    for sign in ('', 'u')
}
TEXTS = ('', 'pan', 'tilt', 'shift', '\x01\x7f', '../../etc/passwd', '$(reboot)', '<script>',
         'ü' * 3000, '\U0001f916', '1e999', 'nan', 'rgb8')  # fmt: skip
SIZES = ((1, 1), (1, 700), (700, 1), (9000, 1), (24, 32), (240, 320))
_SEQUENCE = re.compile(r'sequence<(?P<kind>[^,>]+)(, \d+)?>')
_ARRAY = re.compile(r'(?P<kind>[^\[]+)\[(?P<size>\d+)\]')


def malformed(message_type: Any, rng: random.Random) -> Any:
    """Return a message of a type, or a request of a service, with odd values in its fields."""
    message = message_type()
    for name, kind in message.get_fields_and_field_types().items():
        if rng.random() < 0.7:
            setattr(message, name, _odd(kind, rng))
    return message


def _odd(kind: str, rng: random.Random) -> Any:
    if match := _SEQUENCE.fullmatch(kind):
        return _odd_sequence(match['kind'], rng.choice((0, 1, 2, 3, 7)), rng)
    if match := _ARRAY.fullmatch(kind):
        return _odd_sequence(match['kind'], int(match['size']), rng)
    if '/' in kind:
        return malformed(message_class(kind.replace('/', '/msg/')), rng)
    if kind.startswith('string'):
        return rng.choice(TEXTS)
    if kind == 'boolean':
        return rng.random() < 0.5
    if kind == 'octet':
        return rng.randbytes(1)
    if kind in ('float', 'double'):
        return _odd_number(kind, rng)
    low, high = INTEGERS[kind]
    return rng.choice((low, high, max(low, min(high, 10**9)), 0, 1, rng.randint(low, high)))


def _odd_number(kind: str, rng: random.Random) -> float:
    number = rng.choice(NUMBERS)
    return (
        float(np.clip(number, -3e38, 3e38)) if kind == 'float' and abs(number) > 1e38 else number
    )


def _odd_sequence(kind: str, size: int, rng: random.Random) -> Any:
    if kind == 'uint8':
        return array.array('B', rng.randbytes(rng.choice((0, size, 4096))))
    values = [_odd(kind, rng) for _ in range(size)]
    return b''.join(values) if kind == 'octet' else values


def garbled(message: Any, rng: random.Random) -> bytes:
    """Return a message as it is sent, cut off or with some bytes changed, also inside of texts."""
    data = bytearray(serialize_message(message))
    for _ in range(rng.randrange(1, 4)):
        data[rng.randrange(4, len(data))] = rng.randrange(256)
    return bytes(data[: rng.choice((len(data), rng.randrange(4, len(data) + 1)))])


def foreign(message_type: Any, header: Header) -> list[Any]:
    """Return what other robots publish: valid messages of a type that mean something else."""
    if message_type is JointState:
        wheels = ['wheel_left', 'wheel_right']
        return [
            JointState(header=header, name=wheels, position=[1.0, 2.0], velocity=[0.1, 0.1]),
            JointState(header=header, name=[*wheels, 'pan'], position=[1.0, 2.0, 3.0]),
            JointState(header=header, name=['pan', 'tilt'], velocity=[0.1, 0.1]),
        ]
    if message_type is PointCloud2:
        lidar = {'x': [1.0, 2.0], 'y': [0.0, 0.0], 'z': [0.0, 0.0], 'intensity': [9.0, 9.0]}
        return [encode_columns(header, lidar), PointCloud2(header=header)]
    if message_type is Image:
        depth = Image(header=header, encoding='32FC1', width=4, height=3, step=16, data=bytes(48))
        thermal = Image(
            header=header, encoding='mono16', width=4, height=3, step=8, data=bytes(24)
        )
        return [depth, thermal, Image(header=header, encoding='rgb8')]
    if message_type is CameraInfo:
        return [CameraInfo(header=header), CameraInfo(header=header, k=[-1.0] * 9, width=1920)]
    if message_type is CompressedImage:
        return [CompressedImage(header=header, format='h264', data=bytes(100))]
    if message_type is DiagnosticArray:
        battery = DiagnosticStatus(name='battery', level=b'\x07', message='27 %')
        ours = DiagnosticStatus(name='/gate', level=b'\x01', message='no image')
        many = [DiagnosticStatus(name=f'motor {i}') for i in range(300)]
        return [DiagnosticArray(header=header, status=[battery, ours, *many])]
    if message_type is DiagnosticStatus:
        values = [KeyValue(key=key, value='abc') for key in ('p_lm', 'phase', 'last', 'source')]
        return [DiagnosticStatus(name='battery', values=values)]
    if message_type is String:
        return [String(data='<robot/>'), String(data='<robot><joint name="pan"/></robot>')]
    if message_type is Float64MultiArray:
        return [Float64MultiArray(data=[1.0] * 7)]
    return [message_type()]


def extreme(message_type: Any, header: Header, rng: random.Random) -> Any:
    """Return a message as our own nodes encode it, with numbers of any size."""

    def number() -> float:
        return rng.choice((0.0, 0.3, -2.0, 1e-30, 1e6, -1e12, 1e30))

    if message_type is JointState:
        return JointState(header=header, name=['pan', 'tilt'], position=[number(), number()])
    if message_type is Image:
        height, width = rng.choice(SIZES)
        return encode_image(np.zeros((height, width, 3), np.uint8), header.stamp, header.frame_id)
    if message_type is CameraInfo:
        return encode_camera_info(header, *rng.choice(SIZES), fx=rng.choice((1e-6, 300.0, 1e30)))
    if message_type is PointCloud2:
        return _extreme_cloud(header, number, rng)
    return malformed(message_type, rng)


def _extreme_cloud(header: Header, number: Callable[[], float], rng: random.Random) -> PointCloud2:
    """Return a table, a gaze or detections as our own nodes encode them."""
    kind = rng.choice(('table', 'gaze', 'detections'))
    if kind == 'table':
        names = ('x', 'y', 'z', 'pan', 'tilt', 'weight', 'attended', 'log_evidence', 'u', 'v')
        names += ('expected_gain',) * (rng.random() < 0.5)
        count = rng.choice((0, 1, 3, 478))
        return encode_columns(header, {n: [number() for _ in range(count)] for n in names})
    if kind == 'gaze':
        angles = (0.0, 0.3, -2.0, 1.0, 1e-30)
        return encode_columns(header, {n: [rng.choice(angles)] for n in GAZE})
    return encode_detections(
        header,
        [
            Detection(
                rng.choice(list(Kind)),
                *(number() for _ in range(7)),
                track_id=i,
                attended=rng.random() < 0.5,
                range_m=abs(number()) or math.nan,
                range_deviation_m=abs(number()) or math.nan,
            )
            for i in range(rng.choice((0, 1, 5)))
        ],
    )
