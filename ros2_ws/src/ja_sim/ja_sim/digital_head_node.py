"""digital_head: a pan-tilt head without motors, moving a window inside a wide picture."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Header, String

from ja_common.camera_info_codec import encode_camera_info
from ja_common.camera_input import CameraInput, CameraInputConfig
from ja_common.core.config import Configuration, parameter
from ja_common.graph_node import GraphNode
from ja_common.head_description import CAMERA_FRAME, describe_head
from ja_common.image_codec import encode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.node_main import spin_node
from ja_common.time_codec import to_ns
from ja_common.topics import (
    CAMERA_INFO,
    IMAGE,
    JOINT_COMMANDS,
    JOINT_STATES,
    ROBOT_DESCRIPTION,
    WIDE_IMAGE,
)
from ja_sim.core.digital_head import DigitalHead, DigitalHeadConfig


@dataclass(frozen=True)
class FrameConfig(Configuration):
    """Names on the wire."""

    frame_id: str = parameter(CAMERA_FRAME, 'optical frame of the window')


class DigitalHeadNode(GraphNode):
    """Publishes the head's posture, calibration and view at the stamp of every wide picture."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('digital_head', **node_kwargs)
        self._config = self.configure(DigitalHeadConfig)
        self._frame_id = self.configure(FrameConfig).frame_id
        self._joint_config = self.configure(JointConfig)
        self._joints = JointCodec(self._joint_config)
        wide = self.resolve_topic_name(WIDE_IMAGE.name)
        self._camera = CameraInput(self.configure(CameraInputConfig), wide)
        self._head = DigitalHead(self._config)
        self._joint_publisher = self.create_topic_publisher(JOINT_STATES)
        self._info_publisher = self.create_topic_publisher(CAMERA_INFO)
        self._image_publisher = self.create_topic_publisher(IMAGE)
        self._description_publisher = self.create_topic_publisher(ROBOT_DESCRIPTION)
        self._described_size: tuple[int, ...] = ()
        self.subscribe(JOINT_COMMANDS, self._on_command)
        self.subscribe(WIDE_IMAGE, self._on_wide_image, expected_every_s=2.0)

    def _on_command(self, message: JointState) -> None:
        self._head.command(self._joints.decode_command(message, self._head.target))

    def _on_wide_image(self, message: Image) -> None:
        picture = self._camera.decode(message)
        self._publish_description(picture.shape[1], picture.shape[0])
        view, posture = self._head.render_view(picture, to_ns(message.header.stamp))
        header = Header(stamp=message.header.stamp, frame_id=self._frame_id)
        self._joint_publisher.publish(
            self._joints.encode_posture(header, posture.position, posture.velocity)
        )
        # The window is that of a camera which is mounted as the wide one is.
        view = self._camera.as_mounted(view)
        height, width = view.shape[:2]
        self._info_publisher.publish(
            encode_camera_info(header, width, height, self._head.focal_px)
        )
        self._image_publisher.publish(encode_image(view, header.stamp, header.frame_id))

    def _publish_description(self, wide_width_px: int, wide_height_px: int) -> None:
        """Publish the URDF, whose limits follow from the shape of the wide pictures."""
        size = (wide_width_px, wide_height_px)
        if size != self._described_size:
            self._described_size = size
            limit = self._head.limits(*size)
            description = describe_head(
                self._joint_config,
                np.stack([-limit, limit], axis=1),
                self._config.speed_rad_s,
                wide_camera=True,
            )
            self._description_publisher.publish(String(data=description))


def main(args: Sequence[str] | None = None) -> None:
    """Run the node."""
    spin_node(DigitalHeadNode, args)


if __name__ == '__main__':
    main()
