"""Reads where a face and its eyes are turned, from the landmarks of one image.

The regions that the networks look at are MediaPipe's: the box of the face, then the one of the
landmarks found there, which knows how the head is rolled; and the corners of each eye.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.face_gaze import LEFT, RIGHT, FaceGaze
from ja_perception.core.box import Box
from ja_perception.core.eye_openness import CORNERS
from ja_perception.core.face_crop import crop_face
from ja_perception.core.head_pose import HeadPose, fit_head_pose, gaze_angles
from ja_perception.core.landmark_networks import FaceMesh, IrisFinder, TurnedSquare

# Landmarks at the corners of the eyes, by her own side: outer, inner.
_EYE_CORNERS = {LEFT: (263, 362), RIGHT: (33, 133)}
# What the mesh network looks at, in sides of the box; the iris network, in widths of the eye.
_FACE_WIDTHS, _EYE_WIDTHS = 1.5, 2.3
_LEAST_CONFIDENCE = 0.5
_MOST_OFF_CAMERA_RAD = np.radians(50.0)
# The mesh no longer follows a head that hides half of the face: it shows a turn by 50 degrees as
# 47, by 60 as 49.
_MOST_YAW_RAD = np.radians(45.0)
# The nose hides the far eye of a head that is turned farther.
_FAR_EYE_YAW_RAD = np.radians(25.0)
# The ball of the left eye in the head's axes, from the middle between the corners of the eye, and
# the distance of the iris from its centre. Fitted to the four people of `head_pose`.
_EYEBALL = np.array([0.017, -0.03, 0.155])
_IRIS_DISTANCE = 0.19
# Deviations as measured on four people of the simulated world: on a large face that looks at the
# camera [rad], what the angle from there adds (share of it), what small faces add [rad px]. Of the
# head most is her own, the same in each look: where the mesh sees the brow and chin of her face.
_HEAD_DEVIATION = (np.radians(2.8), 0.09, np.radians(40.0))
_EYE_DEVIATION = (np.radians(5.0), 0.15, np.radians(150.0))
# A face is unchanged while no pixel of its picture, 30 x 25, differs by as much: sensor noise of
# 3 grey levels changes them by less, an iris that turns by 3 degrees by more.
_UNCHANGED_GREY_LEVELS = 8
# A face that has moved in the image is seen along another ray.
_SAME_PLACE_PX = 1.0
# Beyond this share of the distance the iris is not where an eye can turn it.
_MOST_TURNED = 0.95


@dataclass(frozen=True)
class GazeReading:
    """The gaze, and the landmarks (n, 2) [px] that it follows from.

    The 468 of the mesh first, then five for each visible iris, her right one first.
    """

    gaze: FaceGaze
    landmarks: NDArray[np.float64]


@dataclass(frozen=True)
class _Eye:
    angles: tuple[float, float]
    iris: NDArray[np.float64]


class GazeReader:
    """Head pose and eyes by two networks of MediaPipe's, about 15 ms a face.

    Raises ConfigError if this OpenCV cannot read the networks.
    """

    def __init__(self) -> None:
        self._mesh = FaceMesh()
        self._iris = IrisFinder()

    def read(
        self, image: NDArray[np.uint8], face_box: Box, camera: CameraModel
    ) -> GazeReading | None:
        """Read the face in ``face_box`` of an (H, W, 3) RGB image.

        None when there is no face, when it is turned away from the camera by more than about 50
        degrees, or when it blinks: no eye that should be seen is open.
        """
        landmarks = self._find_landmarks(image, face_box)
        if landmarks is None:
            return None
        pose = fit_head_pose(landmarks, camera)
        yaw = pose.angles[0]
        if abs(yaw) > _MOST_YAW_RAD or pose.off_camera_rad > _MOST_OFF_CAMERA_RAD:
            return None
        eyes = np.full((2, 2), np.nan)
        points = [landmarks[:, :2]]
        for side in (RIGHT, LEFT):
            # Her right eye is the far one when she turns to the robot's left.
            towards = yaw if side == RIGHT else -yaw
            if towards > _FAR_EYE_YAW_RAD:
                continue
            eye = self._read_eye(image, landmarks, side, pose, camera)
            if eye is not None:
                eyes[side] = eye.angles
                points.append(eye.iris)
        if len(points) == 1:
            return None
        width_px = max(face_box.width, face_box.height)
        gaze = FaceGaze(
            pose.angles,
            _deviation_rad(*_HEAD_DEVIATION, pose.off_camera_rad, width_px),
            eyes,
            _deviation_rad(*_EYE_DEVIATION, pose.off_camera_rad, width_px),
        )
        return GazeReading(gaze, np.concatenate(points))

    def _find_landmarks(self, image: NDArray[np.uint8], box: Box) -> NDArray[np.float64] | None:
        side = _FACE_WIDTHS * max(box.width, box.height)
        square = TurnedSquare(box.u, box.v, side, 0.0)
        for _ in range(2):
            landmarks, confidence = self._mesh.find_landmarks(image, square)
            if confidence < _LEAST_CONFIDENCE:
                return None
            square = _square_of_face(landmarks[:, :2])
        return landmarks

    def _read_eye(
        self,
        image: NDArray[np.uint8],
        landmarks: NDArray[np.float64],
        side: int,
        pose: HeadPose,
        camera: CameraModel,
    ) -> _Eye | None:
        """Return an eye; None when it is closed."""
        eye = self._iris.find_iris(image, _square_of_eye(landmarks, side))
        if not eye.open:
            return None
        points = np.concatenate([eye.lids[CORNERS], eye.iris[:1]])
        outer, inner, centre = pose.along_ray(camera, points)
        offset = (centre - (outer + inner) / 2) / pose.scale
        return _Eye(_eye_angles(offset, side, pose.rotation), eye.iris)


class StoredGaze:
    """Reads a face again only when it looks different."""

    def __init__(self, reader: GazeReader) -> None:
        self._reader = reader
        self._picture: NDArray[np.uint8] | None = None
        self._box: Box | None = None
        self._reading: GazeReading | None = None

    def read(
        self, image: NDArray[np.uint8], grey: NDArray[np.uint8], face_box: Box, camera: CameraModel
    ) -> GazeReading | None:
        """See `GazeReader.read`; ``grey`` is the same image, (H, W)."""
        picture = crop_face(grey, face_box)
        if not self._is_unchanged(picture, face_box):
            self._reading = self._reader.read(image, face_box, camera)
            self._picture, self._box = picture, face_box
        return self._reading

    def _is_unchanged(self, picture: NDArray[np.uint8], box: Box) -> bool:
        # The largest difference, not the mean: eyes that turn change a few pixels only.
        return (
            self._picture is not None
            and self._box is not None
            and max(abs(box.u - self._box.u), abs(box.v - self._box.v)) < _SAME_PLACE_PX
            and cv2.norm(picture, self._picture, cv2.NORM_INF) < _UNCHANGED_GREY_LEVELS
        )


def _square_of_face(points: NDArray[np.float64]) -> TurnedSquare:
    """Return the square of a face with landmarks (468, 2) [px], upright on its eyes."""
    right, left = points[_EYE_CORNERS[RIGHT][0]], points[_EYE_CORNERS[LEFT][0]]
    roll = float(np.arctan2(*(left - right)[::-1]))
    cosine, sine = np.cos(roll), np.sin(roll)
    upright = np.array([[cosine, sine], [-sine, cosine]])
    turned = points @ upright.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    u, v = (upright.T @ ((low + high) / 2)).tolist()
    return TurnedSquare(u, v, _FACE_WIDTHS * float((high - low).max()), roll)


def _square_of_eye(landmarks: NDArray[np.float64], side: int) -> TurnedSquare:
    outer, inner = landmarks[list(_EYE_CORNERS[side]), :2]
    across = (inner - outer) if side == RIGHT else (outer - inner)
    u, v = ((outer + inner) / 2).tolist()
    roll = float(np.arctan2(across[1], across[0]))
    return TurnedSquare(u, v, _EYE_WIDTHS * float(np.hypot(*across)), roll, side == LEFT)


def _eye_angles(
    offset: NDArray[np.float64], side: int, rotation: NDArray[np.float64]
) -> tuple[float, float]:
    """Return yaw and pitch in the head [rad] of an iris ``offset`` (2,) from between the corners.

    The iris lies on a sphere about the centre of the eyeball; its image says where, see _EYEBALL.
    """
    ball = _EYEBALL * ([1.0, 1.0, 1.0] if side == LEFT else [-1.0, 1.0, 1.0])
    turned = (offset - (rotation @ ball)[:2]) / _IRIS_DISTANCE
    turned *= min(1.0, _MOST_TURNED / max(float(np.hypot(*turned)), 1e-9))
    towards_camera = -np.sqrt(1.0 - turned @ turned)
    return gaze_angles(rotation.T @ np.array([*turned, towards_camera]))


def _deviation_rad(
    least_rad: float, share: float, pixels: float, off_camera_rad: float, width_px: float
) -> float:
    """Return a standard deviation that grows as the head turns and as the face gets smaller."""
    return float(np.linalg.norm([least_rad, share * off_camera_rad, pixels / width_px]))
