"""What was seen, in the message types of others: vision_msgs, and hri_msgs as in REP-155.

The message classes are arguments: no such package needs to be installed to import this module.
"""

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from geometry_msgs.msg import Point
from numpy.typing import NDArray
from std_msgs.msg import Header

from ja_common.core.detection import Detection, Kind
from ja_common.core.face_gaze import FaceGaze
from ja_common.optional_types import find_type

CLASS_IDS = {Kind.OBJECT: 'object', Kind.FACE: 'face'}

# Of the 468 landmarks of a face mesh: those that come nearest to the 68 of dlib, in its order,
# which hri_msgs/FacialLandmarks has, too. Her right side comes first.
_JAW = (
    127, 234, 93, 132, 58, 172, 150, 176, 152, 400, 379, 397, 288, 361, 323, 454, 356,
)  # fmt: skip
_BROWS = (70, 63, 105, 66, 107, 336, 296, 334, 293, 300)
_NOSE = (168, 197, 5, 4, 98, 97, 2, 326, 327)
_EYES = (33, 160, 158, 133, 153, 144, 362, 385, 387, 263, 373, 380)
_LIPS = (
    61, 40, 37, 0, 267, 270, 291, 321, 314, 17, 84, 91, 78, 81, 13, 311, 308, 402, 14, 178,
)  # fmt: skip
MESH_OF_DLIB = np.array([*_JAW, *_BROWS, *_NOSE, *_EYES, *_LIPS])
MESH_POINTS, _IRIS_POINTS = 468, 5
_EYE_CORNERS = ((33, 133), (362, 263))
"""Her right eye, her left eye; the pupils have the last two codes, in this order."""
LANDMARKS = len(MESH_OF_DLIB) + len(_EYE_CORNERS)


@dataclass(frozen=True)
class VisionTypes:
    """The classes of vision_msgs that are needed."""

    array: Any
    detection: Any
    hypothesis: Any

    @staticmethod
    def find() -> 'VisionTypes | None':
        """Return the installed classes; None where vision_msgs is not installed."""
        names = ('Detection2DArray', 'Detection2D', 'ObjectHypothesisWithPose')
        found = [find_type(f'vision_msgs/msg/{name}') for name in names]
        return None if None in found else VisionTypes(*found)


@dataclass(frozen=True)
class HriTypes:
    """The classes of hri_msgs that are needed."""

    ids: Any
    region: Any
    landmarks: Any
    point: Any

    @staticmethod
    def find() -> 'HriTypes | None':
        """Return the installed classes; None where hri_msgs is not installed."""
        names = (
            'IdsList',
            'NormalizedRegionOfInterest2D',
            'FacialLandmarks',
            'NormalizedPointOfInterest2D',
        )
        found = [find_type(f'hri_msgs/msg/{name}') for name in names]
        return None if None in found else HriTypes(*found)


def face_id(detection: Detection, namespace: str = '') -> str:
    """Return the REP-155 identifier of a face: short, begins with a letter, unique by namespace.

    It lasts as long as the track of the face.
    """
    return '_'.join([*filter(None, namespace.split('/')), f'f{max(detection.track_id, 0)}'])


def encode_detections_2d(
    types: VisionTypes, header: Header, detections: list[Detection], namespace: str = ''
) -> Any:
    """Return a Detection2DArray: boxes in pixels, class `object` or `face`, score 0 to 1.

    The position of the pose is where the thing is in the frame of the header, if its range is
    known, else zero. The id of a face is that of `face_id`.
    """
    return types.array(
        header=header,
        detections=[_detection_2d(types, header, each, namespace) for each in detections],
    )


def encode_region(
    types: HriTypes, header: Header, face: Detection, width_px: int, height_px: int
) -> Any:
    """Return the region of a face in a picture of this size, normalised to 0 to 1."""
    left, top, right, bottom = _corners(face)
    (xmin, xmax), (ymin, ymax) = (
        np.clip((np.array(ends) + 0.5) / size, 0.0, 1.0).tolist()
        for ends, size in (((left, right), width_px), ((top, bottom), height_px))
    )
    return types.region(
        header=header, xmin=xmin, ymin=ymin, xmax=xmax, ymax=ymax, c=_confidence(face.score)
    )


def crop_face_picture(
    picture: NDArray[np.uint8], face: Detection, width_px: int, height_px: int
) -> NDArray[np.uint8]:
    """Return a face, scaled, centred and padded with zeros to this size, as REP-155 has it.

    `picture`: (H, W, 3) RGB. All zeros for a box outside of the picture.
    """
    cropped: NDArray[np.uint8] = np.zeros((height_px, width_px, 3), np.uint8)
    left, top, right, bottom = (round(edge + 0.5) for edge in _corners(face))
    part = picture[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)]
    if part.size:
        rows, columns = part.shape[:2]
        scale = min(width_px / columns, height_px / rows)
        size = (max(1, round(columns * scale)), max(1, round(rows * scale)))
        shrinks = scale < 1.0
        part = cv2.resize(
            part, size, interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
        )
        x, y = (width_px - size[0]) // 2, (height_px - size[1]) // 2
        cropped[y : y + size[1], x : x + size[0]] = part
    return cropped


def encode_landmarks(
    types: HriTypes,
    header: Header,
    landmarks: NDArray[np.floating],
    score: float,
    width_px: int,
    height_px: int,
) -> Any:
    """Return FacialLandmarks of a face mesh, (468 or more, 2) [px], in a picture of this size.

    After the mesh come five points for each visible iris, its centre first. A pupil that is not
    seen, and a point outside of the picture, has the confidence 0; the others that of the face.
    Raises ValueError where there are too few points.
    """
    points = np.asarray(landmarks, float)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < MESH_POINTS:
        raise ValueError(
            f'landmarks of shape {points.shape} are no face mesh of {MESH_POINTS} points (u, v)'
        )
    chosen = np.concatenate([points[MESH_OF_DLIB], _pupils(points)])
    shares = (chosen + 0.5) / (width_px, height_px)
    inside = ((shares >= 0.0) & (shares <= 1.0)).all(axis=1)  # false for NaN, too
    shares[~inside] = 0.0
    confidence = np.where(inside, _confidence(score), 0.0)
    return types.landmarks(
        header=header,
        landmarks=[
            types.point(x=x, y=y, c=c)
            for (x, y), c in zip(shares.tolist(), confidence.tolist(), strict=True)
        ],
        height=height_px,
        width=width_px,
    )


def face_position(face: Detection, nominal_distance_m: float) -> NDArray[np.float64]:
    """Return where a face is in the optical frame (3,) [m]: at its range, or the nominal one."""
    ray = np.array([face.x, face.y, 1.0])
    known = face.range_m if math.isfinite(face.range_m) else nominal_distance_m
    return known * ray / float(np.linalg.norm(ray))


def face_rotation(face: Detection, gaze: FaceGaze) -> NDArray[np.float64]:
    """Return the axes of `face_<id>` in the optical frame (3, 3): x out of the face, z up."""
    yaw, pitch, roll = map(float, gaze.head)
    return _facing(face, yaw, pitch, roll)


def gaze_rotation(face: Detection, gaze: FaceGaze) -> NDArray[np.float64]:
    """Return the axes of `gaze_<id>` in the optical frame (3, 3): z along the line of gaze.

    x is to the right and y down for the one who looks. The mean of the visible eyes is added to
    the head's angles; without visible eyes the gaze is where the head faces.
    """
    yaw, pitch, roll = map(float, gaze.head)
    if gaze.visible.any():
        eyes = gaze.eyes[gaze.visible].mean(axis=0)
        yaw, pitch = yaw + float(eyes[0]), pitch + float(eyes[1])
    forward, left, up = _facing(face, yaw, pitch, roll).T
    return np.column_stack([-left, -up, forward])


def _facing(face: Detection, yaw: float, pitch: float, roll: float) -> NDArray[np.float64]:
    """Return the axes (forward, left, up) of a face turned by angles with the signs of FaceGaze.

    In its own view along the ray to the face (right, down, away), as `head_pose` measures them.
    """
    forward = np.array(
        [-math.sin(yaw) * math.cos(pitch), math.sin(pitch), -math.cos(yaw) * math.cos(pitch)]
    )
    level = np.array([math.cos(yaw), 0.0, -math.sin(yaw)])
    down = np.cross(-forward, level)
    left = math.cos(roll) * level + math.sin(roll) * down
    axes = np.column_stack([forward, left, np.cross(forward, left)])
    return _along_ray(face) @ axes


def _along_ray(face: Detection) -> NDArray[np.float64]:
    """Return the axes (right, down, away) (3, 3) of the view along the ray to a face."""
    away = np.array([face.x, face.y, 1.0])
    away /= np.linalg.norm(away)
    right = np.array([away[2], 0.0, -away[0]])
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(away, right), away])


def _detection_2d(types: VisionTypes, header: Header, detection: Detection, namespace: str) -> Any:
    is_face = detection.kind is Kind.FACE
    message = types.detection(
        header=header,
        id=face_id(detection, namespace) if is_face else str(detection.track_id),
    )
    message.bbox.center.position.x = float(detection.u)
    message.bbox.center.position.y = float(detection.v)
    message.bbox.size_x = float(detection.width)
    message.bbox.size_y = float(detection.height)
    result = types.hypothesis()
    result.hypothesis.class_id = CLASS_IDS[detection.kind]
    result.hypothesis.score = _confidence(detection.score)
    if math.isfinite(detection.range_m):
        x, y, z = face_position(detection, detection.range_m).tolist()
        result.pose.pose.position = Point(x=x, y=y, z=z)
    message.results = [result]
    return message


def _corners(face: Detection) -> tuple[float, float, float, float]:
    """Return left, top, right, bottom [px]; pixel (0, 0) is the centre of the first pixel."""
    half_width, half_height = face.width / 2, face.height / 2
    return (
        face.u - half_width,
        face.v - half_height,
        face.u + half_width,
        face.v + half_height,
    )


def _confidence(score: float) -> float:
    return min(max(float(score), 0.0), 1.0)


def _pupils(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return her right and left pupil (2, 2) [px]; NaN for one that is not visible."""
    pupils = np.full((2, 2), np.nan)
    eyes = np.array([points[list(corners)].mean(axis=0) for corners in _EYE_CORNERS])
    for centre in points[MESH_POINTS::_IRIS_POINTS]:
        pupils[np.argmin(np.linalg.norm(eyes - centre, axis=1))] = centre
    return pupils
