"""A pan-tilt head without motors: it moves a window inside the picture of a wide fixed camera."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import Configuration, parameter
from ja_common.core.geometry import finite_pair, head_rotation
from ja_common.core.posture import Posture
from ja_common.core.stamps import NS_PER_S

# From the optical frame (x right, y down, z forward) to the head frame (x forward, y left, z up).
_HEAD_FROM_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


@dataclass(frozen=True)
class DigitalHeadConfig(Configuration):
    """The window, the wide camera and the servos."""

    view_width_px: int = parameter(320, 'width of the window', low=16, high=4096)
    view_height_px: int = parameter(240, 'height of the window', low=16, high=4096)
    view_rad: float = parameter(
        math.radians(36), 'horizontal view of the window', low=0.01, high=2.0
    )
    wide_view_rad: float = parameter(
        math.radians(60), 'horizontal view of the wide camera', low=0.01, high=3.0
    )
    speed_rad_s: float = parameter(7.0, 'highest speed of a servo', low=0.01, high=100.0)
    time_constant_s: float = parameter(
        0.03, 'time constant with which a servo comes to rest', low=0.001, high=10.0
    )


class DigitalHead:
    """Two servos, and the true perspective view that a camera turned by them would have."""

    def __init__(self, config: DigitalHeadConfig = DigitalHeadConfig()) -> None:
        if config.view_rad >= config.wide_view_rad:
            raise ValueError(
                f'view_rad = {config.view_rad} must be narrower than '
                f'wide_view_rad = {config.wide_view_rad}: the window moves inside the wide picture'
            )
        self._config = config
        self._position = np.zeros(2)
        self._velocity = np.zeros(2)
        self._target = np.zeros(2)
        self._stamp_ns: int | None = None

    @property
    def focal_px(self) -> float:
        """Return the focal length of the window [px]; its optical axis goes through its centre."""
        return self._config.view_width_px / 2 / math.tan(self._config.view_rad / 2)

    def limits(self, wide_width_px: int, wide_height_px: int) -> NDArray[np.float64]:
        """Return the greatest pan and tilt, (2,) [rad]: all of the wide picture can be centred."""
        half_width = math.tan(self._config.wide_view_rad / 2)
        return np.arctan([half_width, half_width * wide_height_px / wide_width_px])

    @property
    def target(self) -> NDArray[np.float64]:
        """Return the servos' target (2,) [rad]."""
        return self._target

    def command(self, posture: ArrayLike) -> None:
        """Set the servos' target (pan, tilt) [rad]. ValueError unless two finite numbers."""
        self._target = finite_pair('a commanded posture', posture)

    def render_view(
        self, wide: NDArray[np.uint8], stamp_ns: int
    ) -> tuple[NDArray[np.uint8], Posture]:
        """Run the servos until ``stamp_ns``; return the window's picture and the posture there.

        ``wide``: (H, W, 3) or (H, W) uint8. Beyond the wide picture the view is black.
        """
        height, width = wide.shape[:2]
        limits = self.limits(width, height)
        elapsed_s = 0.0 if self._stamp_ns is None else (stamp_ns - self._stamp_ns) / NS_PER_S
        self._stamp_ns = stamp_ns
        self._run_servos(np.clip(self._target, -limits, limits), max(0.0, elapsed_s))
        posture = Posture(stamp_ns, self._position.copy(), self._velocity.copy())
        return self._view(wide), posture

    def _run_servos(self, target: NDArray[np.float64], elapsed_s: float) -> None:
        """Run at full speed, then approach exponentially: exact for any ``elapsed_s``."""
        tau = self._config.time_constant_s
        gap = target - self._position
        # Within this distance the servo no longer needs its full speed.
        braking = self._config.speed_rad_s * tau
        cruise_s = np.minimum(elapsed_s, np.maximum(0, np.abs(gap) - braking) * tau / braking)
        gap = gap - np.sign(gap) * self._config.speed_rad_s * cruise_s
        gap = gap * np.exp(-(elapsed_s - cruise_s) / tau)
        self._position = target - gap
        self._velocity = np.clip(gap / tau, -self._config.speed_rad_s, self._config.speed_rad_s)

    def _view(self, wide: NDArray[np.uint8]) -> NDArray[np.uint8]:
        config = self._config
        wide_focal = wide.shape[1] / 2 / math.tan(config.wide_view_rad / 2)
        if wide_focal > 1.5 * self.focal_px:
            # Shrink first, or the window would skip pixels.
            shrink = self.focal_px / wide_focal
            wide = cv2.resize(wide, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
            wide_focal = wide.shape[1] / 2 / math.tan(config.wide_view_rad / 2)
        rotation = _HEAD_FROM_OPTICAL.T @ head_rotation(self._position) @ _HEAD_FROM_OPTICAL
        size = (config.view_width_px, config.view_height_px)
        window_to_wide = (
            _intrinsics(wide_focal, wide.shape[1], wide.shape[0])
            @ rotation
            @ np.linalg.inv(_intrinsics(self.focal_px, *size))
        )
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return cv2.warpPerspective(wide, window_to_wide, size, flags=flags)


def _intrinsics(focal: float, width: int, height: int) -> NDArray[np.float64]:
    return np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])
