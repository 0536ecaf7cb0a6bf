"""camera: a webcam, network camera, film, folder or picture as image_raw and camera_info."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import Header

from ja_common.camera_info_codec import encode_camera_info
from ja_common.core.camera_model import CameraModel
from ja_common.core.config import Configuration, parameter
from ja_common.core.health import Level
from ja_common.core.stamps import NS_PER_S
from ja_common.graph_node import GraphNode
from ja_common.head_description import CAMERA_FRAME
from ja_common.image_codec import encode_image
from ja_common.node_main import spin_node
from ja_common.topics import CAMERA_INFO, IMAGE
from ja_perception.core.frame_sources import NotYetError, SourceError, SourceOptions
from ja_perception.core.live_sources import shown_url
from ja_perception.core.open_source import open_source

_LEAST_NS = 1_000_000
_LATEST_S = 1.0
"""A node that is later than this gives up the lost time, and reports it."""


@dataclass(frozen=True)
class CameraConfig(Configuration):
    """Where the pictures come from, and at which rate they are published."""

    source: str = parameter(
        '0', 'device number or path, address (rtsp://, http://), film, folder, or picture'
    )
    rate_hz: float = parameter(
        0.0, "pictures a second; 0: the times of the film's own pictures, the camera's rate, or "
        '15 for stills', low=0.0, high=1000.0,
    )  # fmt: skip
    highest_rate_hz: float = parameter(
        120.0, 'pictures a second that a film or camera reaches at most', low=1.0, high=1000.0
    )
    loop: bool = parameter(True, 'restart at the end of a film or folder')
    still_s: float = parameter(
        5.0, 'time for which each picture of a folder is shown', low=0.0, high=3600.0
    )
    field_of_view_rad: float = parameter(
        math.radians(60), 'horizontal view of the camera', low=0.01, high=3.0
    )
    frame_id: str = parameter(CAMERA_FRAME, 'optical frame named in the headers')


class CameraNode(GraphNode):
    """Publishes pictures when they are due; ends when a film that does not loop has ended."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('camera', **node_kwargs)
        config = self._config = self.configure(CameraConfig)
        options = SourceOptions(
            config.loop, config.rate_hz, config.highest_rate_hz, config.still_s
        )
        try:
            self._source = open_source(config.source, options, self._warn)
        except SourceError as error:
            # An OSError ends the node with this one sentence.
            raise OSError(str(error)) from None
        self.get_logger().info(self._source.summary)
        self._image_publisher = self.create_topic_publisher(IMAGE)
        self._info_publisher = self.create_topic_publisher(CAMERA_INFO)
        # A camera delivers whatever the clocks do: only the stamps follow them.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._due_s = time.monotonic() + self._source.period_s
        self._timer = self.create_timer(self._source.period_s, self._publish_due, clock=steady)

    def _warn(self, where: str, text: str) -> None:
        self.report_problem(where, text, Level.WARN)

    def _publish_due(self) -> None:
        try:
            self._publish_next()
        except NotYetError:
            pass
        except SourceError as error:
            self.report_problem('source', str(error))
        self.health.values['source'] = self._source.summary
        self._set_timer()

    def _set_timer(self) -> None:
        """Let the timer expire when the next picture is due: films have no constant rate."""
        now_s = time.monotonic()
        self._due_s += self._source.period_s
        if now_s - self._due_s > _LATEST_S:
            self._due_s = now_s
            self._warn(
                'pace', 'the pictures are published later than they are due: this computer does '
                'not read and send them as fast; lower rate_hz or highest_rate_hz'
            )  # fmt: skip
        self._timer.timer_period_ns = max(_LEAST_NS, round((self._due_s - now_s) * NS_PER_S))
        self._timer.reset()

    def _publish_next(self) -> None:
        frame = self._source.next_frame()
        if frame is None:
            self.get_logger().info(f"'{shown_url(self._config.source)}' has ended")
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
