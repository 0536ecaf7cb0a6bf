"""What measures the range of detections: depth images, or the images of a second camera."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image

from ja_common.camera_info_codec import decode_calibration
from ja_common.camera_input import CameraInput
from ja_common.core.camera_calibration import CameraCalibration
from ja_common.core.camera_model import CameraModel
from ja_common.core.config import Configuration, parameter
from ja_common.core.health import Level
from ja_common.core.stamp_buffer import StampBuffer
from ja_common.depth_decoder import decode_depth
from ja_common.graph_node import GraphNode
from ja_common.time_codec import to_ns
from ja_common.topics import DEPTH, RIGHT_CAMERA_INFO, RIGHT_IMAGE
from ja_perception.core.depth_ranges import DepthPicture
from ja_perception.core.ranging import RangeSensor
from ja_perception.core.stereo_ranges import SecondView, pair_geometry

_STRAIGHT_AHEAD = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_ANGLE = 1e-6  # a matrix of rotation that differs by no more is the identity


@dataclass(frozen=True)
class RangeConfig(Configuration):
    """How the distance to faces and objects is measured, if at all."""

    depth: str = parameter(
        'none', 'none; picture: from depth/image_raw, registered to the image; second_camera: by '
        'matching right/image_raw, both images rectified',
        choices=('none', 'picture', 'second_camera'),
    )  # fmt: skip
    depth_within_s: float = parameter(
        0.02, 'largest difference between the stamps of an image and of its depth',
        low=0.0, high=1.0,
    )  # fmt: skip
    depth_wait_s: float = parameter(
        0.2, 'longest time that an image waits for its depth', low=0.0, high=60.0
    )
    nearest_m: float = parameter(
        0.3, 'second camera: no thing is nearer; less takes more time', low=0.05, high=10.0
    )


class RangeInput:
    """Subscribes for a node to what measures depth, and finds what belongs to an image."""

    def __init__(
        self,
        node: GraphNode,
        config: RangeConfig,
        camera: CameraInput,
        arrived: Callable[[], None],
        expected_every_s: float,
    ) -> None:
        """`arrived` is called after each message: an image may have waited for it.

        Silence for longer than `expected_every_s` [s] is a warning, as are images without depth.
        """
        self._node, self._config, self._camera = node, config, camera
        self._arrived, self._patience_s = arrived, expected_every_s
        self._buffer: StampBuffer[Image] = StampBuffer(config.depth_within_s, config.depth_wait_s)
        self._right: CameraCalibration | None = None
        self._found_s = self._known_s = time.monotonic()
        self._was_found = False  # depth for the newest image
        topic = DEPTH
        if config.depth == 'second_camera':
            topic = RIGHT_IMAGE
            node.subscribe(RIGHT_CAMERA_INFO, self._on_right_camera_info, expected_every_s)
        self._topic_name = node.resolve_topic_name(topic.name)
        if self.is_chosen:
            node.subscribe(topic, self._on_image, expected_every_s)

    @property
    def is_chosen(self) -> bool:
        """Return whether ranges are measured at all."""
        return self._config.depth != 'none'

    def must_wait(self, stamp_ns: int, waited_s: float) -> bool:
        """Return whether an image that has waited so long [s] may still get its depth."""
        return self.is_chosen and self._buffer.must_wait(stamp_ns, waited_s)

    def sensor_at(
        self, stamp_ns: int, frame_id: str, image: NDArray[np.uint8], camera: CameraModel
    ) -> RangeSensor | None:
        """Return what measured the depth of an upright image (H, W, 3) of a camera.

        `frame_id`: of the image, which a depth picture registered to it has, too. None where
        nothing usable belongs to the stamp; the cause is then reported.
        """
        if not self.is_chosen:
            return None
        self._was_found = False
        message = self._buffer.nearest(stamp_ns)
        now_s = time.monotonic()
        if message is None:
            # One that is lost now and then is no problem.
            if now_s - self._found_s > self._patience_s:
                self._report(self._why_missing(stamp_ns))
            return None
        try:
            sensor = self._decode(message, camera)
            sensor.check(image)
            self._check_registered(message.header.frame_id, frame_id)
        except ValueError as error:
            self._report(str(error))
            return None
        self._found_s, self._was_found = now_s, True
        self._node.health.clear_problem('depth')
        return sensor

    def _decode(self, message: Image, camera: CameraModel) -> RangeSensor:
        turns = self._camera.quarter_turns
        if self._config.depth == 'picture':
            samples, unit_m = decode_depth(message)
            return DepthPicture(np.rot90(samples, -turns), unit_m)
        if self._right is None:
            raise ValueError('no usable right/camera_info has come, which holds the baseline')
        focal_baseline, offset_px = pair_geometry(
            camera.turned(-turns), self._right, self._camera.rectified
        )
        # Both cameras are mounted alike.
        picture = self._camera.decode(message)
        return SecondView(picture, focal_baseline, offset_px, turns, self._config.nearest_m)

    def record_known(self, known: int, seen: int) -> None:
        """Note how many of the detections of an image have a range, and report if none ever has.

        Depth that is all holes is no error of any one image.
        """
        now_s = time.monotonic()
        if known or not seen:
            self._known_s = now_s
        elif self._was_found and now_s - self._known_s > self._patience_s:
            self._report('its images come, but hold no distance where things are seen')

    def _check_registered(self, depth_frame: str, image_frame: str) -> None:
        """Raise ValueError for depth that another camera has seen: its ranges would be false."""
        if self._config.depth != 'picture' or not (depth_frame and image_frame):
            return
        if depth_frame != image_frame:
            raise ValueError(
                f'it is of the frame {depth_frame!r}, the image of {image_frame!r}: remap '
                "depth/image_raw to depth that is registered to the image, in the image's frame"
            )

    def _why_missing(self, stamp_ns: int) -> str:
        off_s = self._buffer.seconds_off(stamp_ns)
        if off_s is None:
            return 'no message has come'
        return (
            f'the nearest one is stamped {1000 * off_s:.0f} ms off the image, more than '
            f'{1000 * self._config.depth_within_s:g} ms (depth_within_s), or comes later than '
            f'{self._config.depth_wait_s:g} s (depth_wait_s)'
        )

    def _report(self, why: str) -> None:
        text = f'detections have no range; {self._topic_name}: {why}'
        self._node.report_problem('depth', text, Level.WARN)

    def _on_image(self, message: Image) -> None:
        self._buffer.record_item(to_ns(message.header.stamp), message)
        self._arrived()

    def _on_right_camera_info(self, message: CameraInfo) -> None:
        self._right = None
        calibration = decode_calibration(message)
        calibration.check(rectified=True)
        if not self._camera.rectified and not _is_identity(message.r):
            raise ValueError(
                'R turns the images of the second camera to rectify them: remap image_raw and '
                'right/image_raw to the rectified ones (image_rect), and set image_geometry to '
                'rectified'
            )
        self._right = calibration


def _is_identity(rotation: Any) -> bool:
    """Return whether R (9,) turns nothing; zeros stand for a camera without a pair."""
    matrix = np.asarray(rotation, float)
    return not matrix.any() or bool(np.abs(matrix - _STRAIGHT_AHEAD).max() <= _ANGLE)
