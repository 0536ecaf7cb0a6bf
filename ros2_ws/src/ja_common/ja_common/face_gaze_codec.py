"""Head pose and eyes on the wire: a point cloud of one point, see `FaceGaze` for the fields."""

import math

import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from ja_common.core.face_gaze import LEFT, RIGHT, FaceGaze
from ja_common.point_cloud_codec import decode_columns, encode_columns

_HEAD = ('head_yaw', 'head_pitch', 'head_roll', 'head_deviation')
_EYES = ('left_yaw', 'left_pitch', 'right_yaw', 'right_pitch')
FIELDS = (*_HEAD, *_EYES, 'eye_deviation', 'left_visible', 'right_visible')
"""All angles in [rad]; the angles of an eye that is not visible are NaN."""


def encode_face_gaze(header: Header, gaze: FaceGaze) -> PointCloud2:
    """Return one message for one image; `header` is the image's own, unchanged."""
    head = [*gaze.head, gaze.head_deviation_rad]
    values = [*head, *gaze.eyes.ravel(), gaze.eye_deviation_rad, *gaze.visible]
    return encode_columns(
        header, {name: [float(value)] for name, value in zip(FIELDS, values, strict=True)}
    )


def decode_face_gaze(message: PointCloud2) -> FaceGaze:
    """Return the reading of a message.

    Raises ValueError when it is not of one face, a field is missing, or an angle of the head, or
    of an eye that counts as visible, is no angle.
    """
    if message.width * message.height != 1:
        raise ValueError(f'face_gaze holds {message.width * message.height} faces, not one')
    columns = {name: float(value[0]) for name, value in decode_columns(message, FIELDS).items()}
    eyes = np.array([columns[name] for name in _EYES]).reshape(2, 2)
    visible = np.array([columns['left_visible'], columns['right_visible']]) > 0.5
    eyes[~visible] = math.nan
    angles = [*(columns[name] for name in _HEAD), *eyes[visible].ravel()]
    if visible.any():
        angles.append(columns['eye_deviation'])
    if not all(abs(angle) <= math.pi for angle in angles):  # false for NaN, too
        raise ValueError('face_gaze holds an angle that is not between -pi and pi')
    return FaceGaze(
        np.array([columns[name] for name in _HEAD[:3]]),
        columns['head_deviation'],
        eyes[[LEFT, RIGHT]],
        columns['eye_deviation'],
    )
