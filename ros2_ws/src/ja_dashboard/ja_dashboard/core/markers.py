"""What the head sees and does as plain shapes in three dimensions, for viewers such as RViz.

All points are in the base frame of the head [m]: x forward, y left, z up, the optical centre of
the camera in the origin.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection, Kind, caregiver_face
from ja_common.core.geometry import (
    directions_of_rays,
    head_rotation,
    vectors_of_directions,
    vectors_of_rays,
)

Colour = tuple[float, float, float, float]
"""Red, green, blue, opacity, each 0-1."""

_AMBER, _CREAM, _BLUE = (0.96, 0.62, 0.04, 1.0), (0.99, 0.90, 0.54, 1.0), (0.22, 0.74, 0.97, 0.8)
_VIOLET, _PINK, _GREEN = (0.75, 0.52, 0.99, 1.0), (1.0, 0.35, 0.78, 1.0), (0.29, 0.87, 0.50, 1.0)
_RED, _WHITE = (0.97, 0.25, 0.25, 1.0), (0.93, 0.93, 0.93, 1.0)
_CIRCLE_POINTS = 48
_POINTS_AN_EDGE = 8
# Of the nominal distance.
_THICK, _THIN, _POINT, _LETTER, _ABOVE = 0.012, 0.005, 0.02, 0.05, 0.05


class Form(Enum):
    """How the points of a shape are drawn."""

    ARROW = 'arrow from the first point to the second'
    LINE = 'line through all points'
    SEGMENTS = 'line between each two points'
    POINTS = 'points'
    TEXT = 'text at the first point'


@dataclass(frozen=True)
class Shape:
    """One thing to draw: `points` (n, 3) [m], `size_m` its line, point or letter size.

    `group`: what it shows; a viewer switches groups on and off. `opacities` (n,), 0-1, of single
    points, where they differ.
    """

    group: str
    form: Form
    points: NDArray[np.float64]
    colour: Colour
    size_m: float
    text: str = ''
    opacities: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class HeadScene:
    """What is known at one image.

    `posture` (2,) [rad] and `detections` are those of the image. `gaze` (2,) [rad]: yaw and pitch
    of the attended face as in `FaceGaze`. `fixation`, `command` (2,) [rad] and `belief` (n, 3)
    (pan, tilt [rad], weight) are the newest ones. None, or empty, where there is none.
    """

    posture: NDArray[np.float64]
    detections: Sequence[Detection] = ()
    camera: CameraModel | None = None
    gaze: NDArray[np.float64] | None = None
    fixation: NDArray[np.float64] | None = None
    command: NDArray[np.float64] | None = None
    belief: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))


def shapes_of(scene: HeadScene, distance_m: float, d_th_rad: float) -> list[Shape]:
    """Return all that can be drawn of an image.

    `distance_m`: where directions end of which no range is known. `d_th_rad`: d_th of Eq. 3.
    """
    shapes = []
    for detection in scene.detections:
        shapes += _of_detection(scene.posture, detection, distance_m)
    shapes.append(_fixation_circle(scene.posture, distance_m, d_th_rad))
    if scene.camera is not None:
        shapes += _field_of_view(scene.posture, scene.camera, distance_m)
    if len(scene.belief):
        shapes.append(_belief(scene.belief, distance_m))
    shapes += _gaze(scene, distance_m)
    if scene.command is not None:
        shapes.append(_direction('commanded', scene.command, _RED, distance_m))
    if (attended := _attended_direction(scene)) is not None:
        shapes.append(_direction('attended', attended, _GREEN, distance_m))
    # A lens may have no ray for a pixel, and viewers refuse what is not finite.
    return [shape for shape in shapes if np.isfinite(shape.points).all()]


def place_of(posture: ArrayLike, detection: Detection, distance_m: float) -> NDArray[np.float64]:
    """Return where a detection is drawn (3,) [m]: at its range, else at `distance_m`."""
    range_m = detection.range_m if math.isfinite(detection.range_m) else distance_m
    return range_m * _unit(vectors_of_rays(posture, detection.ray))


def label_of(detection: Detection) -> str:
    """Return the text beside a detection."""
    face = detection.kind is Kind.FACE
    number = '' if face or detection.track_id < 0 else f' {detection.track_id}'
    name = f'{"face" if face else "object"}{number}'
    parts = [f'{name} {detection.score:.2f}']
    if math.isfinite(detection.range_m):
        parts.append(f'{detection.range_m:.2f} m')
    if detection.attended:
        parts.append('attended')
    return ', '.join(parts)


def gaze_vector(
    posture: ArrayLike, face: Detection, yaw_pitch: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the unit vector (3,) of a gaze in the base frame; angles (2,) as in `FaceGaze`.

    They are measured from the line of sight to the face, back to the camera.
    """
    along_sight = head_rotation(posture) @ head_rotation(directions_of_rays((0, 0), face.ray))
    return np.asarray(along_sight @ ([-1.0, 1.0, 1.0] * vectors_of_directions(yaw_pitch)))


def _of_detection(posture: ArrayLike, detection: Detection, distance_m: float) -> list[Shape]:
    face = detection.kind is Kind.FACE
    group, colour = ('face', _CREAM) if face else ('object', _AMBER)
    end = place_of(posture, detection, distance_m)
    above = end + np.array([0.0, 0.0, _ABOVE * distance_m])
    return [
        Shape(f'{group}_rays', Form.ARROW, _from_origin(end), colour, _THICK * distance_m),
        Shape(
            f'{group}_labels',
            Form.TEXT,
            above[None],
            _WHITE,
            _LETTER * distance_m,
            label_of(detection),
        ),
    ]


def _fixation_circle(posture: ArrayLike, distance_m: float, d_th_rad: float) -> Shape:
    turns = np.linspace(0.0, 2 * math.pi, _CIRCLE_POINTS + 1)
    rays = math.tan(d_th_rad) * np.column_stack([np.cos(turns), np.sin(turns)])
    points = distance_m * _unit(vectors_of_rays(posture, rays))
    return Shape('fixation_circle', Form.LINE, points, _WHITE, _THIN * distance_m)


def _field_of_view(posture: ArrayLike, camera: CameraModel, distance_m: float) -> list[Shape]:
    """Draw the edge of the image, which a lens bends, and the rays through its corners."""
    right, bottom = camera.width - 0.5, camera.height - 0.5
    corners = np.array([[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]])
    share = np.arange(_POINTS_AN_EDGE)[:, None] / _POINTS_AN_EDGE
    following = np.roll(corners, -1, axis=0)
    edges = [a + share * (b - a) for a, b in zip(corners, following, strict=True)]
    pixels = np.concatenate([*edges, corners[:1]])
    edge = distance_m * _unit(vectors_of_rays(posture, camera.rays(pixels)))
    ends = edge[: 4 * _POINTS_AN_EDGE : _POINTS_AN_EDGE]
    sides = np.stack([np.zeros_like(ends), ends], axis=1).reshape(-1, 3)
    size_m = _THIN * distance_m
    return [
        Shape('field_of_view', Form.LINE, edge, _BLUE, size_m),
        Shape('field_of_view', Form.SEGMENTS, sides, _BLUE, size_m),
    ]


def _belief(belief: NDArray[np.float64], distance_m: float) -> Shape:
    points = distance_m * vectors_of_directions(belief[:, :2])
    weights = np.clip(belief[:, 2], 0.0, None)
    opacities = weights / max(weights.max(), 1e-12)
    return Shape('belief', Form.POINTS, points, _VIOLET, _POINT * distance_m, opacities=opacities)


def _gaze(scene: HeadScene, distance_m: float) -> list[Shape]:
    face = next((each for each in scene.detections if each.gaze_read), None)
    if face is None or scene.gaze is None:
        return []
    start = place_of(scene.posture, face, distance_m)
    end = start + distance_m * gaze_vector(scene.posture, face, scene.gaze)
    return [Shape('gaze', Form.ARROW, np.array([start, end]), _PINK, _THICK * distance_m)]


def _attended_direction(scene: HeadScene) -> NDArray[np.float64] | None:
    """Return what the head attends to: the fixated object, or else the face in the centre."""
    face = caregiver_face(list(scene.detections))
    if scene.fixation is None and face is not None and face.attended:
        return directions_of_rays(scene.posture, face.ray)
    return scene.fixation


def _direction(group: str, direction: ArrayLike, colour: Colour, distance_m: float) -> Shape:
    end = distance_m * vectors_of_directions(direction)
    return Shape(group, Form.ARROW, _from_origin(end), colour, _THICK * distance_m)


def _from_origin(end: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([np.zeros(3), end])


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
