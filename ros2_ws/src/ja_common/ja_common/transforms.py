"""Poses and transforms on the wire; `tf` where tf2_msgs is installed."""

from typing import Any

import numpy as np
from geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
from numpy.typing import ArrayLike
from rclpy.qos import DurabilityPolicy, QoSProfile
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header

from ja_common.optional_types import find_type
from ja_common.topics import Topic

TF_TYPE = 'tf2_msgs/msg/TFMessage'


def tf_topics() -> tuple[Topic, Topic] | None:
    """Return the topics of moving and of fixed transforms; None without tf2_msgs.

    The names are relative, as all of ours: in a namespace two heads with the same frames each
    have a tree of their own. Without a namespace they are `/tf` and `/tf_static`.
    """
    message_type = find_type(TF_TYPE)
    if message_type is None:
        return None
    moving = QoSProfile(depth=100)
    fixed = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    return (
        Topic('tf', message_type, 'where the frames are that move', moving, moving),
        Topic('tf_static', message_type, 'where the frames are that stand still', fixed, fixed),
    )


def encode_tf(transforms: list[TransformStamped]) -> Any:
    """Return a message of transforms; only where `tf_topics` are known."""
    message_type = find_type(TF_TYPE)
    assert message_type is not None
    return message_type(transforms=transforms)


def encode_transform(
    header: Header, child: str, rotation: ArrayLike, position: ArrayLike
) -> TransformStamped:
    """Return where a frame is in the frame of the header: rotation (3, 3), position (3,) [m]."""
    x, y, z = np.asarray(position, float).tolist()
    return TransformStamped(
        header=header,
        child_frame_id=child,
        transform=Transform(translation=Vector3(x=x, y=y, z=z), rotation=_quaternion(rotation)),
    )


def encode_pose(header: Header, rotation: ArrayLike, position: ArrayLike) -> PoseStamped:
    """Return the pose of something in the frame of the header, as `encode_transform`."""
    x, y, z = np.asarray(position, float).tolist()
    return PoseStamped(
        header=header,
        pose=Pose(position=Point(x=x, y=y, z=z), orientation=_quaternion(rotation)),
    )


def _quaternion(rotation: ArrayLike) -> Quaternion:
    x, y, z, w = Rotation.from_matrix(rotation).as_quat()
    sign = -1.0 if w < 0.0 else 1.0
    return Quaternion(x=sign * x, y=sign * y, z=sign * z, w=sign * w)
