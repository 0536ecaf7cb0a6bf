"""Draws detections into the camera image, for people."""

import colorsys
import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection, Kind, most_salient

Colour = tuple[int, int, int]
_WHITE: Colour = (255, 255, 255)
_FACE: Colour = (255, 220, 60)
# Colour, edge and motion, in the order of Eq. 1.
_FEATURE_COLOURS: tuple[Colour, ...] = ((255, 80, 80), (80, 200, 255), (140, 255, 100))
_BAR_GROUND: Colour = (60, 60, 60)
_BAR_PX = 40
_LEAST_SIDE = 480
# OpenCV cannot draw at pixels much farther out; detections of other nodes may stand anywhere.
_FARTHEST_PX = 30_000.0
_GOLDEN_RATIO = 0.618033988749895


def annotate_image(
    image: NDArray[np.uint8],
    detections: Sequence[Detection],
    face_image: NDArray[np.uint8] | None,
    camera: CameraModel,
    d_th_rad: float,
    latency_s: float,
) -> NDArray[np.uint8]:
    """Return a copy of an (H, W, 3) RGB image, enlarged if small, with all detections drawn in."""
    enlarge = max(1, math.ceil(_LEAST_SIDE / max(image.shape[:2])))
    canvas = cv2.resize(image, None, fx=enlarge, fy=enlarge, interpolation=cv2.INTER_LINEAR)
    radius = round(min(enlarge * camera.fx * math.tan(d_th_rad), _FARTHEST_PX))
    cv2.circle(canvas, _at((camera.cx, camera.cy), enlarge), radius, _WHITE, 1, cv2.LINE_AA)
    target = most_salient(list(detections))
    for detection in detections:
        _draw(canvas, detection, enlarge, is_target=detection is target)
    if face_image is not None:
        _inset(canvas, face_image)
    _text(canvas, f'{1000 * latency_s:.1f} ms', (6, canvas.shape[0] - 8), _WHITE)
    return canvas


def _draw(canvas: NDArray[np.uint8], detection: Detection, enlarge: int, is_target: bool) -> None:
    half = (detection.width / 2, detection.height / 2)
    top_left = _at((detection.u - half[0], detection.v - half[1]), enlarge)
    bottom_right = _at((detection.u + half[0], detection.v + half[1]), enlarge)
    face = detection.kind is Kind.FACE
    colour = _FACE if face else _colour_of(detection.track_id)
    thickness = 3 if is_target or detection.attended else 1
    cv2.rectangle(canvas, top_left, bottom_right, colour, thickness, cv2.LINE_AA)
    name = ('face' if face else 'object') + f' {detection.track_id}  {detection.score:.2f}'
    if math.isfinite(detection.range_m):
        name += f'  {detection.range_m:.2f} m'
    _text(canvas, name, (top_left[0], top_left[1] - 5), colour)
    if not face:
        _feature_bars(canvas, detection, (top_left[0], bottom_right[1] + 3))


def _feature_bars(
    canvas: NDArray[np.uint8], detection: Detection, corner: tuple[int, int]
) -> None:
    features = (detection.f_col, detection.f_edg, detection.f_mot)
    for row, (value, colour) in enumerate(zip(features, _FEATURE_COLOURS, strict=True)):
        top = corner[1] + 4 * row
        for length, shade in ((1.0, _BAR_GROUND), (value, colour)):
            end = corner[0] + round(_BAR_PX * min(max(length, 0.0), 1.0))
            cv2.rectangle(canvas, (corner[0], top), (end, top + 2), shade, cv2.FILLED)


def _inset(canvas: NDArray[np.uint8], face_image: NDArray[np.uint8]) -> None:
    """Draw the face image, enlarged, into the upper right corner; what does not fit is cut off."""
    scale = max(1, canvas.shape[0] // 4 // face_image.shape[0])
    shown = face_image[: canvas.shape[0], : canvas.shape[1]]
    enlarged = cv2.resize(shown, None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST)
    height, width = (min(pair) for pair in zip(enlarged.shape, canvas.shape, strict=False))
    canvas[:height, -width:] = enlarged[:height, :width, None]


def _text(canvas: NDArray[np.uint8], text: str, place: tuple[int, int], colour: Colour) -> None:
    x, y = max(2, place[0]), max(12, place[1])
    for shade, thickness in (((0, 0, 0), 3), (colour, 1)):
        cv2.putText(
            canvas, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, 0.45, shade, thickness, cv2.LINE_AA
        )


def _at(pixel: tuple[float, float], enlarge: int) -> tuple[int, int]:
    column, row = (min(max((x + 0.5) * enlarge - 0.5, -_FARTHEST_PX), _FARTHEST_PX) for x in pixel)
    return round(column), round(row)


def _colour_of(track_id: int) -> Colour:
    """Return the colour of a track; neighbouring numbers get colours far apart."""
    red, green, blue = colorsys.hsv_to_rgb(track_id * _GOLDEN_RATIO % 1, 0.7, 1.0)
    return round(255 * red), round(255 * green), round(255 * blue)
