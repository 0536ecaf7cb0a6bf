"""Finds the one face of a photograph, upright and at a fixed size, with its landmarks in depth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.config import ConfigError
from ja_common.core.sample_depth import SampleDepth
from ja_perception.core.box import Box
from ja_perception.core.face_finders import FACE_FINDERS
from ja_perception.core.face_tracking import scan_squares, search_square, whole_square
from ja_perception.core.faces import Face, suppress_non_maxima
from ja_perception.core.frame_sources import SourceError
from ja_perception.core.head_pose import HeadPose, fit_head_pose
from ja_perception.core.landmark_networks import FaceMesh, TurnedSquare
from ja_perception.core.pictures import read_picture

SIDE_PX = 720
"""Side of the upright cut of the photograph, in which the eyes are `EYES_APART_PX` apart."""
EYES_APART_PX = 80.0
MIDDLE_OF_EYES_PX = (360.0, 320.0)
RIGHT_EYE, LEFT_EYE = (33, 133), (263, 362)
"""Landmarks at the outer and the inner corner of her eyes."""
MOST_YAW_DEG, MOST_PITCH_DEG = 20.0, 25.0

_SEARCH_PX = 1280  # larger pictures are searched reduced
_LEAST_SCORE, _LEAST_CONFIDENCE = 0.6, 0.5
_LEAST_FACE_PX = 40
_SMALLEST_SHARE = 0.05  # of the picture's longer side, of the faces that are searched for
_SAME_FACE = 0.4
# A face of this share of the largest one's width is a second person, not the background.
_SECOND_PERSON = 0.45
_FACE_WIDTHS = 1.5
# The field of view of a camera that is not known; the pose hardly depends on it.
_VIEW_RAD = np.radians(60.0)

Landmarks = NDArray[np.float64]


class PhotoError(ConfigError):
    """A photograph of which no head can be made; one sentence with the reason and what to do."""


@dataclass(frozen=True, eq=False)
class PhotoFace:
    """A face, upright in a cut of the photograph, (SIDE_PX, SIDE_PX, 3) uint8 RGB.

    `landmarks`: (468, 3) [px] of the cut, the third is the depth, smaller where nearer. `pose`:
    how the head is turned. `inside`: (SIDE_PX, SIDE_PX) bool, where the cut shows the photograph
    and not its repeated borders. `width_px`: of the face in the photograph.
    """

    picture: NDArray[np.uint8]
    landmarks: Landmarks
    pose: HeadPose
    inside: NDArray[np.bool_]
    width_px: float


class PhotoFaceFinder:
    """Finds faces with the project's own detector and landmarks. Raises ConfigError without."""

    def __init__(self) -> None:
        self._finder = FACE_FINDERS['blazeface']()
        self._mesh = FaceMesh()

    def read_photo(self, path: Path) -> PhotoFace:
        """Find the face in a picture file. Raises PhotoError, which names the file."""
        try:
            shown = read_picture(path, SampleDepth(), _ignore)
        except SourceError as error:
            raise PhotoError(str(error)) from None
        return self.find_face(shown[0].pixels, f"'{path}'")

    def find_face(self, picture: NDArray[np.uint8], name: str = 'the picture') -> PhotoFace:
        """Find the one face in an (H, W, 3) RGB picture. Raises PhotoError, with its name."""
        box = self._only_face(picture, name)
        if box.width < _LEAST_FACE_PX:
            raise PhotoError(
                f'the face in {name} is {box.width:.0f} pixels wide: take a photograph in which '
                f'it has at least {_LEAST_FACE_PX}'
            )
        square = TurnedSquare(box.u, box.v, _FACE_WIDTHS * max(box.width, box.height), 0.0)
        for _ in range(3):
            landmarks = self._landmarks(picture, square, name)
            square = _square_of_face(landmarks)
        cut = _upright_square(landmarks)
        sharp = _reduced(picture, cut)
        upright = sharp.square.cut_from(sharp.picture, SIDE_PX)
        square = _square_of_face(_in_cut(landmarks, cut))
        landmarks = self._landmarks(upright, square, name)
        camera = CameraModel.from_field_of_view(SIDE_PX, SIDE_PX, _VIEW_RAD)
        pose = fit_head_pose(landmarks, camera)
        _check_frontal(pose, name)
        return PhotoFace(
            upright,
            landmarks,
            pose,
            _covered(picture.shape, cut),
            box.width,
        )

    def _only_face(self, picture: NDArray[np.uint8], name: str) -> Box:
        faces = self._find_faces(picture)
        if not faces:
            raise PhotoError(
                f'no face is found in {name}: take a photograph of a person who looks at the '
                'camera, in even light'
            )
        widest = max(face.box.width for face in faces)
        large = [face for face in faces if face.box.width > _SECOND_PERSON * widest]
        if len(large) > 1:
            raise PhotoError(
                f'{name} shows {len(large)} faces: cut out the one that shall be the caregiver'
            )
        return large[0].box

    def _find_faces(self, picture: NDArray[np.uint8]) -> list[Face]:
        """Return the faces of all sizes, each confirmed by a search in a square around it."""
        scale = min(1.0, _SEARCH_PX / max(picture.shape[:2]))
        small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        image = np.asarray(small, np.uint8) if scale < 1.0 else picture
        height, width = image.shape[:2]
        whole = whole_square(width, height)
        # A face that fills its picture is found with room around it.
        wide = Box(whole.u, whole.v, 1.6 * whole.width, 1.6 * whole.height)
        smallest = max(_LEAST_FACE_PX / 2, _SMALLEST_SHARE * whole.width)
        squares = [wide, *scan_squares(width, height, smallest / self._finder.smallest_share)]
        found: list[Face] = []
        for square in squares:
            for face in self._finder.find_faces(image, square):
                around = Box(face.box.u, face.box.v, *[2.2 * max(face.box[2:])] * 2)
                framed = around if square is wide else search_square(face.box, whole)
                again = self._finder.find_faces(image, framed)
                found += [
                    each
                    for each in again
                    if each.score >= _LEAST_SCORE and each.box.overlap(face.box) > _SAME_FACE
                ]
        return [
            Face(face.box.scaled(1 / scale), face.score, face.keypoints / scale)
            for face in suppress_non_maxima(found)
        ]

    def _landmarks(self, picture: NDArray[np.uint8], square: TurnedSquare, name: str) -> Landmarks:
        landmarks, confidence = self._mesh.find_landmarks(picture, square)
        if confidence < _LEAST_CONFIDENCE:
            raise PhotoError(
                f'the face in {name} is not seen clearly enough for its landmarks: take a '
                'photograph from the front, with nothing before the face'
            )
        return landmarks


@dataclass(frozen=True)
class _Reduced:
    picture: NDArray[np.uint8]
    square: TurnedSquare


def _reduced(picture: NDArray[np.uint8], square: TurnedSquare) -> _Reduced:
    """Return the picture and the square at a size at which a cut of SIDE_PX has no aliasing."""
    scale = SIDE_PX / square.side
    if scale >= 1.0:
        return _Reduced(picture, square)
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    at = Box(square.u, square.v, square.side, square.side).scaled(scale)
    return _Reduced(
        np.asarray(small, np.uint8), TurnedSquare(at.u, at.v, at.width, square.roll_rad)
    )


def _covered(shape: tuple[int, ...], cut: TurnedSquare) -> NDArray[np.bool_]:
    """Return where a cut lies within a picture of this shape (H, W, ...)."""
    axis = np.arange(SIDE_PX, dtype=float)
    u, v = np.meshgrid(axis, axis)
    there = cut.to_image(np.column_stack([u.ravel(), v.ravel()]), SIDE_PX)
    height, width = shape[:2]
    within = (there > -0.5).all(axis=1) & (there < [width - 0.5, height - 0.5]).all(axis=1)
    return within.reshape(SIDE_PX, SIDE_PX)


def _eyes(landmarks: Landmarks) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the middle between the corners of her right and of her left eye [px]."""
    return landmarks[list(RIGHT_EYE)].mean(axis=0), landmarks[list(LEFT_EYE)].mean(axis=0)


def _roll(landmarks: Landmarks) -> float:
    right, left = _eyes(landmarks)
    return float(np.arctan2(left[1] - right[1], left[0] - right[0]))


def _square_of_face(landmarks: Landmarks) -> TurnedSquare:
    """Return the upright square around landmarks that the mesh network looks at."""
    roll = _roll(landmarks)
    cosine, sine = np.cos(roll), np.sin(roll)
    upright = np.array([[cosine, sine], [-sine, cosine]])
    turned = landmarks[:, :2] @ upright.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    u, v = (upright.T @ ((low + high) / 2)).tolist()
    return TurnedSquare(u, v, _FACE_WIDTHS * float((high - low).max()), roll)


def _upright_square(landmarks: Landmarks) -> TurnedSquare:
    """Return the square of the cut in which the eyes lie where `MIDDLE_OF_EYES_PX` puts them."""
    right, left = _eyes(landmarks)
    roll = _roll(landmarks)
    # In depth as well: a head that is turned a little is as large.
    scale = float(np.linalg.norm(left - right)) / EYES_APART_PX
    middle = (SIDE_PX - 1) / 2
    offset = scale * (middle - np.array(MIDDLE_OF_EYES_PX))
    cosine, sine = np.cos(roll), np.sin(roll)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    u, v = ((right[:2] + left[:2]) / 2 + turn @ offset).tolist()
    return TurnedSquare(u, v, SIDE_PX * scale, roll)


def _in_cut(landmarks: Landmarks, cut: TurnedSquare) -> Landmarks:
    """Return landmarks [px] of the picture in pixels of the cut."""
    cosine, sine = np.cos(cut.roll_rad), np.sin(cut.roll_rad)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    scale = SIDE_PX / cut.side
    flat = (landmarks[:, :2] - [cut.u, cut.v]) @ turn * scale + (SIDE_PX - 1) / 2
    return np.column_stack([flat, landmarks[:, 2] * scale])


def _check_frontal(pose: HeadPose, name: str) -> None:
    yaw, pitch, _ = np.degrees(pose.angles)
    if abs(yaw) > MOST_YAW_DEG or abs(pitch) > MOST_PITCH_DEG:
        aside = max(abs(yaw), abs(pitch))
        raise PhotoError(
            f'the face in {name} is turned by {aside:.0f} degrees: take a photograph in which it '
            f'looks at the camera, within {MOST_YAW_DEG:.0f} degrees'
        )


_ignore: Callable[[str, str], None] = lambda key, text: None  # noqa: E731
