"""What a camera publishes, as upright pictures with the camera model that fits them.

The one place at which images enter: all code behind it sees an upright RGB picture, whatever the
encoding of the driver, the depth of the sensor, and the way in which the camera is mounted.
"""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, CompressedImage
from std_msgs.msg import Header

from ja_common.camera_info_codec import decode_calibration
from ja_common.core.camera_calibration import CameraCalibration
from ja_common.core.camera_model import CameraModel
from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.core.sample_depth import SampleDepth
from ja_common.image_codec import decode_compressed, decode_image

_TURNS = {
    90: cv2.ROTATE_90_CLOCKWISE,
    180: cv2.ROTATE_180,
    270: cv2.ROTATE_90_COUNTERCLOCKWISE,
}


@dataclass(frozen=True)
class CameraInputConfig(Configuration):
    """How the camera is mounted, and what its messages do not state."""

    image_rotation_deg: int = parameter(
        0, 'clockwise turn that makes the images upright: 0, 90, 180 (camera upside down) or 270',
        low=0, high=270,
    )  # fmt: skip
    significant_bits: int = parameter(
        0, 'bits that the sensor uses of 16-bit samples; 0: found from the brightest ones so far',
        low=0, high=16,
    )  # fmt: skip
    image_geometry: str = parameter(
        'auto', 'rectified: images without lens distortion, for which P of camera_info holds, not '
        'K and D; auto: those of a topic named image_rect... are',
        choices=('auto', 'raw', 'rectified'),
    )  # fmt: skip

    def check_together(self) -> None:
        """Raise ConfigError unless the turn is by right angles and a picture has 8 bits."""
        if self.image_rotation_deg % 90:
            raise ConfigError(
                f'image_rotation_deg = {self.image_rotation_deg} is not one of 0, 90, 180, 270'
            )
        if 0 < self.significant_bits < 8:
            raise ConfigError(
                f'significant_bits = {self.significant_bits} is not 0 (find out), or 8 to 16'
            )


class CameraInput:
    """Decodes the images and the calibration of one camera; ``image_topic`` is resolved."""

    def __init__(self, config: CameraInputConfig, image_topic: str) -> None:
        self.quarter_turns = config.image_rotation_deg // 90
        """How often the images are turned clockwise by 90 degrees to be upright."""
        self._turn = _TURNS.get(config.image_rotation_deg)
        self._depth = SampleDepth(config.significant_bits)
        self.rectified = config.image_geometry == 'rectified' or (
            config.image_geometry == 'auto' and '/image_rect' in image_topic
        )
        """Whether the images are taken to be without lens distortion."""
        self._calibration: CameraCalibration | None = None

    @property
    def has_calibration(self) -> bool:
        """Return whether a calibration has come, be it one of zeros."""
        return self._calibration is not None

    def record_camera_info(self, message: CameraInfo) -> None:
        """Keep a calibration. Raises ValueError for a bad one; the last good one stays."""
        calibration = decode_calibration(message)
        calibration.check(self.rectified)
        self._calibration = calibration

    def decode(self, message: Any) -> NDArray[np.uint8]:
        """Return the upright picture, (H, W, 3) uint8 RGB, of an Image or CompressedImage.

        Raises ``ImageError`` when it is none. The array may share memory with the message.
        """
        compressed = isinstance(message, CompressedImage)
        decode = decode_compressed if compressed else decode_image
        picture = decode(message, self._depth)
        return picture if self._turn is None else cv2.rotate(picture, self._turn)

    def as_mounted(self, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return an upright picture (H, W, 3) as the camera would deliver it."""
        back = _TURNS.get(360 - 90 * self.quarter_turns)
        return picture if back is None else cv2.rotate(picture, back)

    def camera(self, picture: NDArray[np.uint8]) -> CameraModel | None:
        """Return the camera of an upright picture; None where it is not calibrated.

        Raises ValueError where the calibration is not for images of such a shape.
        """
        if self._calibration is None:
            return None
        height, width = picture.shape[:2]
        if self.quarter_turns % 2:
            height, width = width, height
        camera = self._calibration.camera(width, height, self.rectified)
        return None if camera is None else camera.turned(self.quarter_turns)

    def full_view(self) -> CameraModel | None:
        """Return the camera of upright pictures of the calibrated size, without a picture.

        None where it is not calibrated. Raises ValueError where the calibration is impossible.
        """
        if self._calibration is None:
            return None
        camera = self._calibration.full_view(self.rectified)
        return None if camera is None else camera.turned(self.quarter_turns)

    def upright_header(self, header: Header) -> Header:
        """Return the header of what is measured in the upright picture.

        With a rotation its frame is not the camera's own: `_upright` is added to the name.
        """
        if self._turn is None:
            return header
        return Header(stamp=header.stamp, frame_id=f'{header.frame_id}_upright')
