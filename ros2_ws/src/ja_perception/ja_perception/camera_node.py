"""camera: a webcam, video file, image folder or single image as image_raw and camera_info."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import Header

from ja_common.core.camera_model import CameraModel
from ja_common.core.config import Configuration, parameter
from ja_common.graph_node import GraphNode
from ja_common.image_codec import encode_camera_info, encode_image
from ja_common.node_main import spin_node
from ja_common.topics import CAMERA_INFO, IMAGE
from ja_perception.core.frame_sources import SourceError, open_source


@dataclass(frozen=True)
class CameraConfig(Configuration):
    """Where the pictures come from, and at which rate they are published."""

    source: str = parameter(
        '0', 'device number or path, video file, folder of images, or image file'
    )
    rate_hz: float = parameter(
        0.0, "pictures a second; 0: the source's own rate, or 15", low=0.0, high=1000.0
    )
    loop: bool = parameter(True, 'restart at the end of a file or folder')
    still_s: float = parameter(
        5.0, 'time for which each picture of a folder is shown', low=0.0, high=3600.0
    )
    field_of_view_rad: float = parameter(
        math.radians(60), 'horizontal view of the camera', low=0.01, high=3.0
    )
    frame_id: str = parameter('camera_optical_frame', 'optical frame named in the headers')


class CameraNode(GraphNode):
    """Publishes pictures at a rate; ends when a file that does not loop has ended."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('camera', **node_kwargs)
        config = self._config = self.configure(CameraConfig)
        still_frames = max(1, round(config.still_s * (config.rate_hz or 15)))
        try:
            self._source = open_source(config.source, config.loop, still_frames)
        except SourceError as error:
            # An OSError ends the node with this one sentence.
            raise OSError(str(error)) from None
        self._image_publisher = self.create_topic_publisher(IMAGE)
        self._info_publisher = self.create_topic_publisher(CAMERA_INFO)
        rate_hz = config.rate_hz or self._source.rate_hz or 15.0
        # A camera delivers whatever the clocks do: only the stamps follow them.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1 / rate_hz, self._publish_next, clock=steady)

    def _publish_next(self) -> None:
        try:
            frame = self._source.next_frame()
        except SourceError as error:
            self.report_problem('source', str(error))
            return
        if frame is None:
            self.get_logger().info(f"'{self._config.source}' has ended")
            raise ExternalShutdownException()
        stamp = self.get_clock().now().to_msg()
        header = Header(stamp=stamp, frame_id=self._config.frame_id)
        height, width = frame.shape[:2]
        camera = CameraModel.from_field_of_view(width, height, self._config.field_of_view_rad)
        self._info_publisher.publish(encode_camera_info(header, width, height, camera.fx))
        self._image_publisher.publish(encode_image(frame, header.stamp, header.frame_id))

    def destroy_node(self) -> None:
        """Release the device, then destroy the node."""
        self._source.close()
        super().destroy_node()


def main(args: Sequence[str] | None = None) -> None:
    """Run the node."""
    spin_node(CameraNode, args)


if __name__ == '__main__':
    main()
