"""`head_frames`: where the frames of the head are, from its URDF and the joint states."""

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import JointState
from std_msgs.msg import Header, String

from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.core.health import Level
from ja_common.core.stamps import NS_PER_S
from ja_common.graph_node import GraphNode
from ja_common.head_description import BASE_FRAME, CAMERA_FRAME, describe_head
from ja_common.joint_codec import JointConfig
from ja_common.node_main import spin_node
from ja_common.optional_types import how_to_install
from ja_common.time_codec import to_ns
from ja_common.topics import CAMERA_POSE, JOINT_STATES, ROBOT_DESCRIPTION
from ja_common.transforms import encode_pose, encode_tf, encode_transform, tf_topics
from ja_control.core.urdf import LARGEST_URDF
from ja_control.core.urdf_frames import FrameTree, Pose

_SHIPPED = 'pan_tilt'
_CHECKED_EVERY_S = 2.0
_OTHER_PUBLISHER = 'robot_state_publisher'
_NICENESS = 10  # on a busy processor the graph comes first


@dataclass(frozen=True)
class HeadFramesConfig(Configuration):
    """Which head it is, and what is published of it."""

    urdf: str = parameter(
        '',
        'file with the URDF of the head, which is then published as robot_description; pan_tilt: '
        'the shipped one; empty: subscribe to robot_description',
    )
    base_frame: str = parameter(BASE_FRAME, 'link of the URDF in which head/camera_pose is')
    camera_frame: str = parameter(CAMERA_FRAME, 'link of the URDF: optical frame of the camera')
    image_rotation_deg: int = parameter(
        0, 'as of salient_feature_detector: a fixed frame ..._upright is added for such a camera',
        low=0, high=270,
    )  # fmt: skip
    highest_rate_hz: float = parameter(
        50.0, 'messages a second for each joint, by their stamps', low=0.1, high=1000.0
    )

    def check_together(self) -> None:
        """Raise ConfigError unless the turn is by right angles."""
        if self.image_rotation_deg % 90:
            raise ConfigError(
                f'image_rotation_deg = {self.image_rotation_deg} is not one of 0, 90, 180, 270'
            )


class HeadFramesNode(GraphNode):
    """Publishes `head/camera_pose`, and `tf` and `tf_static` where tf2_msgs is installed.

    A joint that a message does not state keeps its last position, as with robot_state_publisher.
    """

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('head_frames', **node_kwargs)
        self._config = self.configure(HeadFramesConfig)
        self._joints = self.configure(JointConfig)
        self._tree: FrameTree | None = None
        self._needed: set[str] = set()
        self._has_received = False
        self._positions: dict[str, float] = {}
        self._published_ns: dict[str, int] = {}
        self._camera_pose = self.create_topic_publisher(CAMERA_POSE)
        topics = tf_topics()
        self._tf = None if topics is None else self.create_topic_publisher(topics[0])
        self._tf_static = None if topics is None else self.create_topic_publisher(topics[1])
        self._report_tf()
        if self._config.urdf:
            self._publish_description()
        else:
            self.subscribe(ROBOT_DESCRIPTION, self._on_robot_description)
        self.subscribe(JOINT_STATES, self._on_joint_states, expected_every_s=2.0)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_CHECKED_EVERY_S, self._check, clock=steady)

    def _report_tf(self) -> None:
        if self._tf is None:
            text = (
                f'tf2_msgs is not installed: only {CAMERA_POSE.name} is published, no tf and no '
                f'tf_static ({how_to_install("tf2_msgs")})'
            )
            self.get_logger().info(text)
        else:
            text = 'tf and tf_static are published'
        self.health.values['transforms'] = text

    def _publish_description(self) -> None:
        """Publish the URDF of the parameter, and use it. Raises ConfigError where it cannot be."""
        try:
            text = self._read_urdf()
            self._use(text)
        except (OSError, ValueError) as error:
            raise ConfigError(f'urdf: {error}') from None
        publisher = self.create_topic_publisher(ROBOT_DESCRIPTION)
        publisher.publish(String(data=text))

    def _read_urdf(self) -> str:
        if self._config.urdf == _SHIPPED:
            return describe_head(self._joints)
        with Path(self._config.urdf).expanduser().open(encoding='utf-8') as file:
            return file.read(LARGEST_URDF + 1)

    def _on_robot_description(self, message: String) -> None:
        self._tree = None
        self._use(message.data)

    def _use(self, urdf: str) -> None:
        """Take the frames from a URDF. Raises ValueError where it cannot be used."""
        tree = FrameTree(urdf)
        self._needed = tree.joints_between(self._config.camera_frame, self._config.base_frame)
        self._tree = tree
        self._published_ns.clear()
        self.health.clear_problem('robot description')
        if self._tf_static is not None:
            stamp = self.get_clock().now().to_msg()
            fixed = [
                (joint.parent, joint.child, joint.pose())
                for joint in tree.joints
                if joint.is_fixed
            ]
            if degrees := self._config.image_rotation_deg:
                frame = self._config.camera_frame
                fixed.append((frame, f'{frame}_upright', _upright(degrees)))
            self._tf_static.publish(
                encode_tf(
                    [
                        encode_transform(Header(stamp=stamp, frame_id=parent), child, *pose)
                        for parent, child, pose in fixed
                    ]
                )
            )

    def _on_joint_states(self, message: JointState) -> None:
        self._has_received = True
        if self._tree is None:
            return
        if len(message.position) != len(message.name):
            if message.position:
                raise ValueError(
                    f'{len(message.position)} positions for {len(message.name)} names'
                )
            return
        stated = dict(zip(message.name, message.position, strict=True))
        bad = sorted(name for name, position in stated.items() if not math.isfinite(position))
        stated = {name: position for name, position in stated.items() if name not in bad}
        self._positions.update(stated)
        self._publish(message, {name: stated[name] for name in self._due(message, stated)})
        if bad:
            raise ValueError(f'the positions of {bad} are not finite')

    def _due(self, message: JointState, stated: dict[str, float]) -> list[str]:
        """Return the joints whose last transform is old enough, by the stamps."""
        now_ns = to_ns(message.header.stamp)
        period_ns = NS_PER_S / self._config.highest_rate_hz
        due = []
        for name in stated:
            # After a clock was set back, the last one is in the future.
            passed_ns = now_ns - self._published_ns.get(name, -(2**63))
            if not 0 <= passed_ns < period_ns:
                self._published_ns[name] = now_ns
                due.append(name)
        return due

    def _publish(self, message: JointState, moved: dict[str, float]) -> None:
        tree = self._tree
        assert tree is not None
        stamp = message.header.stamp
        joints = list(tree.moving_joints(moved))
        if joints and self._tf is not None:
            self._tf.publish(
                encode_tf(
                    [
                        encode_transform(
                            Header(stamp=stamp, frame_id=joint.parent),
                            joint.child,
                            *tree.joint_pose(joint, self._positions),
                        )
                        for joint in joints
                    ]
                )
            )
        known = self._needed <= self._positions.keys()
        if known and (self._needed & moved.keys() or not self._needed):
            config = self._config
            pose = tree.pose(config.camera_frame, config.base_frame, self._positions)
            header = Header(stamp=stamp, frame_id=config.base_frame)
            self._camera_pose.publish(encode_pose(header, *pose))

    def _check(self) -> None:
        """Report what is missing, and who else publishes the same frames."""
        if self._tree is None:
            text = (
                f'no usable {ROBOT_DESCRIPTION.name}: publish the URDF of the head, or set urdf '
                f'to its file or to {_SHIPPED}'
            )
            self.report_problem('robot description', text, Level.WARN)
        elif self._has_received and (missing := sorted(self._needed - self._positions.keys())):
            text = f'{JOINT_STATES.name} has not stated {missing}, joints of the URDF, yet'
            self.report_problem('joints', text, Level.WARN)
        else:
            self.health.clear_problem('joints')
        if self._tf is not None and _OTHER_PUBLISHER in self.get_node_names():
            text = f'{_OTHER_PUBLISHER} publishes tf as well: stop one of the two'
            self.report_problem('tf', text, Level.WARN)
        else:
            self.health.clear_problem('tf')


def _upright(degrees: int) -> Pose:
    """Return where the frame of upright pictures is in that of a camera.

    The pictures are turned clockwise by so many degrees to be upright, so the frame is turned the
    other way about the optical axis, which points away from the viewer.
    """
    angle = -math.radians(degrees)
    sine, cosine = round(math.sin(angle)), round(math.cos(angle))
    rotation: NDArray[np.float64] = np.array(
        [[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]
    )
    return Pose(rotation, np.zeros(3))


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    os.nice(_NICENESS)
    spin_node(HeadFramesNode, args)


if __name__ == '__main__':
    main()
