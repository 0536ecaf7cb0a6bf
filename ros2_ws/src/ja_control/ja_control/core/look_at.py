"""The direction of a point that another node wants the head to look at.

Points are in the base frame (x forward at pan 0, y left, z up) or in the optical frame of the
camera (x right, y down, z forward), [m]. Both have their origin where pan and tilt axes meet.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.core.geometry import directions_of_vectors, head_rotation

_NO_DIRECTION_M = 1e-6
_WITHIN_LIMITS_RAD = 1e-6


@dataclass(frozen=True)
class LookAtConfig(Configuration):
    """The names of the two frames in which a point to look at may be given."""

    base_frame: str = parameter(
        'base_link',
        'frame of points on look_at: x forward at pan 0, y left, z up, the camera in its origin',
    )
    camera_frame: str = parameter(
        'camera_optical_frame',
        'optical frame of points on look_at, as of the images: x right, y down, z forward',
    )

    def check_together(self) -> None:
        """Raise ConfigError when both frames have one name."""
        if self.base_frame == self.camera_frame:
            raise ConfigError(
                f'base_frame and camera_frame are both {self.base_frame!r}: points on look_at '
                'need two names'
            )

    def is_camera_frame(self, frame: str) -> bool:
        """Return whether this is the frame of the camera; ValueError if it is neither of both."""
        if frame not in (self.base_frame, self.camera_frame):
            raise ValueError(
                f'the frame {frame!r} is not known: give the point in {self.base_frame!r} '
                f'(base_frame) or in {self.camera_frame!r} (camera_frame)'
            )
        return frame == self.camera_frame


def checked_point(point: ArrayLike) -> NDArray[np.float64]:
    """Return the unit vector (3,) towards a point (3,) [m], in the point's own frame.

    Raises ValueError for a point that is not finite, or that is the origin.
    """
    vector = np.array(point, float)
    if not np.isfinite(vector).all():
        raise ValueError(f'the point is not finite: {vector.tolist()}')
    largest = float(np.abs(vector).max())
    if largest < _NO_DIRECTION_M:
        raise ValueError('the point is the origin of its frame: it has no direction')
    vector /= largest  # so that no square overflows
    return vector / np.linalg.norm(vector)


def base_vector(in_camera: ArrayLike, posture: ArrayLike) -> NDArray[np.float64]:
    """Return a vector (3,) of the optical frame in the base frame; `posture`: (2,) [rad]."""
    right, down, forward = np.asarray(in_camera, float)
    return head_rotation(posture) @ np.array([forward, -right, -down])


def direction_to_take(
    vector: ArrayLike, reachable: Callable[[NDArray[np.float64]], NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Return the direction (2,) [rad] of a base-frame vector (3,).

    `reachable` returns the posture at which a motion towards a target ends. Raises ValueError for
    a point behind the head, unless the limits of the joints reach it. What is before the head
    and beyond the limits is left to the command guard, which turns as far as it may.
    """
    vector = np.asarray(vector, float)
    direction = directions_of_vectors(vector)
    if vector[0] < 0 and np.abs(reachable(direction) - direction).max() > _WITHIN_LIMITS_RAD:
        pan, tilt = direction
        raise ValueError(
            f'the point is behind the head, at pan {pan:.2f} and tilt {tilt:.2f} rad, where the '
            'limits of the joints do not reach'
        )
    return direction
