"""The pose of a head from landmarks in three dimensions."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.geometry import directions_of_rays, rays_of_directions

# The oval of the face and the corners of the eyes, which an expression moves least: landmark on
# her right side, its mirror image on her left, and where the latter lies on a face that looks at
# the camera (right in the image, down, away). The network's own landmarks for four people of the
# simulated world who face the camera (anna, bilal, chiyo, dieter), averaged and made symmetrical;
# the root mean square of all 468 is the unit, about 45 mm.
_REFERENCE = (
    (10, 10, 0.000, -1.640, -0.247),
    (109, 338, 0.368, -1.632, -0.220),
    (67, 297, 0.680, -1.586, -0.098),
    (103, 332, 0.965, -1.482, 0.116),
    (21, 251, 1.257, -1.106, 0.608),
    (162, 389, 1.313, -0.882, 0.870),
    (127, 356, 1.326, -0.603, 1.084),
    (234, 454, 1.306, -0.336, 1.192),
    (93, 323, 1.286, -0.061, 1.226),
    (132, 361, 1.244, 0.234, 1.199),
    (58, 288, 1.160, 0.543, 1.112),
    (172, 397, 1.041, 0.795, 0.937),
    (136, 365, 0.900, 0.983, 0.734),
    (150, 379, 0.720, 1.145, 0.570),
    (149, 378, 0.570, 1.256, 0.442),
    (176, 400, 0.414, 1.354, 0.308),
    (148, 377, 0.233, 1.424, 0.222),
    (152, 152, 0.000, 1.447, 0.189),
    (33, 263, 0.871, -0.629, 0.144),
    (133, 362, 0.332, -0.591, 0.043),
)
_INDICES = np.array([row[:2] for row in _REFERENCE]).ravel()
_ON_HER_LEFT = np.array([row[2:] for row in _REFERENCE])
_POINTS = np.stack([_ON_HER_LEFT * [-1, 1, 1], _ON_HER_LEFT], axis=1).reshape(-1, 3)
_CENTRED = _POINTS - _POINTS.mean(axis=0)


class HeadPose(NamedTuple):
    """A head as seen along the ray to it.

    ``direction`` (2,) [rad]: pan and tilt of the ray from the optical axis. ``rotation`` (3, 3):
    from the head's axes (to her left, down, backwards) to those of a camera that looks along the
    ray (right, down, forwards): the identity while she faces the camera. ``scale``: the size of
    the unit of the head's axes, about 45 mm, at unit focal length.
    """

    direction: NDArray[np.float64]
    rotation: NDArray[np.float64]
    scale: float

    @property
    def angles(self) -> NDArray[np.float64]:
        """Return yaw, pitch and roll (3,) [rad], with the signs of `FaceGaze`."""
        forward = -self.rotation[:, 2]
        yaw, pitch = gaze_angles(forward)
        level = np.array([-forward[2], 0.0, forward[0]]) / np.hypot(forward[0], forward[2])
        to_her_left, below_level = self.rotation[:, 0], np.cross(-forward, level)
        return np.array([yaw, pitch, np.arctan2(to_her_left @ below_level, to_her_left @ level)])

    @property
    def off_camera_rad(self) -> float:
        """Return the angle between where the head faces and the camera."""
        return float(np.arccos(np.clip(self.rotation[2, 2], -1.0, 1.0)))

    def along_ray(self, camera: CameraModel, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return pixels (n, 2) as rays (n, 2) of a camera that looks along the ray to the head."""
        return _along(self.direction, camera, pixels)


def gaze_angles(forward: NDArray[np.float64]) -> tuple[float, float]:
    """Return yaw and pitch [rad], signs of `FaceGaze`, of a vector (right, down, away)."""
    right, down, away = forward
    return float(np.arctan2(-right, -away)), float(np.arctan2(down, np.hypot(right, away)))


def fit_head_pose(landmarks: NDArray[np.float64], camera: CameraModel) -> HeadPose:
    """Fit the reference points to landmarks (468, 3) [px] of `FaceMesh` (Umeyama 1991)."""
    chosen = landmarks[_INDICES]
    direction = directions_of_rays((0.0, 0.0), camera.rays(chosen[:, :2].mean(axis=0)))
    flat = _along(direction, camera, chosen[:, :2])
    points = np.column_stack([flat, chosen[:, 2] / camera.fx])
    points -= points.mean(axis=0)
    left, stretch, right = np.linalg.svd(points.T @ _CENTRED)
    stretch[2] *= np.sign(np.linalg.det(left @ right))
    left[:, 2] *= np.sign(np.linalg.det(left @ right))
    return HeadPose(direction, left @ right, float(stretch.sum() / (_CENTRED**2).sum()))


def _along(
    direction: NDArray[np.float64], camera: CameraModel, pixels: NDArray[np.float64]
) -> NDArray[np.float64]:
    return rays_of_directions(direction, directions_of_rays((0.0, 0.0), camera.rays(pixels)))
