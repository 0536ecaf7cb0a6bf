"""The drawings of the live page, as SVG: the scene from above, and the head's postures.

Both show the view of the robot: its left is on the left. The user units of the two drawings are
metres and degrees.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from ja_common.core.detection import Detection, Kind
from ja_dashboard.core.view_model import SceneView

_DISTANCE_M = 1.0
"""A camera measures directions: detections of which no range is known lie on this arc."""
_REACH_M = 1.3
_BELIEF_M = 1.15
_GAZE_M = 1.0

_STYLE = """<style>
.area { fill: #38bdf822; stroke: #38bdf8 } .limit { fill: none; stroke: #64748b }
.object { fill: #f59e0b } .face { fill: #fde68a; stroke: #b45309 } .belief { fill: #c084fc }
.truth { fill: none; stroke: #4ade80 } .attended { fill: #4ade8055 } .head { fill: #38bdf8 }
.command, .gaze { stroke: #f472b6 } .arc { fill: none; stroke: #334155 }
svg * { vector-effect: non-scaling-stroke; stroke-width: 1.5 }
text { fill: #94a3b8; stroke: none; font-family: sans-serif }
</style>"""


def from_above(scene: SceneView) -> str:
    """Draw the scene from above: the robot below, x forward is up, y left is left."""
    parts = [
        f'<path class="arc" d="{_arc(_DISTANCE_M, -math.pi / 2, math.pi / 2)}"/>',
        *_belief_from_above(scene),
    ]
    if scene.posture is not None:
        pan, half = scene.posture[0], scene.half_view[0]
        sector = f'{_arc(_REACH_M, pan - half, pan + half)} L 0 0 Z'
        parts.append(f'<path class="area" d="{sector}"><title>field of view</title></path>')
    for detection, direction in zip(scene.detections, scene.directions, strict=True):
        x, y = _from_above(_shown_distance_m(detection), direction)
        face = detection.kind is Kind.FACE
        name = 'face' if face else f'object {detection.track_id}'
        if math.isfinite(detection.range_m):
            name += f', {detection.range_m:.2f} m'
        if detection.attended and scene.gaze is not None:
            parts.append(_gaze_from_above(x, y, scene.gaze[0]))
        shape = f'class="{"face" if face else "object"}" r="{0.09 if face else 0.04}"'
        parts.append(f'<circle {shape} cx="{x:.3f}" cy="{y:.3f}"><title>{name}</title></circle>')
    if scene.truth is not None:
        for index, (x, y, _) in enumerate(scene.truth.positions):
            parts.append(_true_place(-y, -x, 0.065, index == scene.truth.attended))
    parts.append('<circle class="head" r="0.06"><title>the robot</title></circle>')
    return _svg((-1.4, -1.4, 2.8, 1.55), parts)


def postures(scene: SceneView) -> str:
    """Draw pan and tilt within their limits: measured (ring), commanded (cross), detections."""
    left, right = _degrees([scene.high[0], scene.low[0]]) * -1.0
    top, bottom = _degrees([scene.low[1], scene.high[1]])
    parts = [_box('limit', left, top, right, bottom, 'limits of the joints')]
    parts += [
        f'<circle class="belief" fill-opacity="{opacity:.2f}" cx="{x:.1f}" cy="{y:.1f}" r="0.9"/>'
        for (x, y), opacity in _belief(scene)
    ]
    for detection, direction in zip(scene.detections, scene.directions, strict=True):
        x, y = _at(direction)
        face = detection.kind is Kind.FACE
        shape = f'class="{"face" if face else "object"}" r="{3 if face else 1.6}"'
        parts.append(f'<circle {shape} cx="{x:.1f}" cy="{y:.1f}"/>')
    if scene.truth is not None:
        for index, place in enumerate(scene.truth.directions):
            parts.append(_true_place(*_at(place), 2.6, index == scene.truth.attended))
    if scene.posture is not None:
        x, y = _at(scene.posture)
        half_x, half_y = _degrees(scene.half_view)
        view = (x - half_x, y - half_y, x + half_x, y + half_y)
        parts.append(_box('area', *view, 'field of view'))
        parts.append(f'<circle class="limit" stroke="#fff" cx="{x:.1f}" cy="{y:.1f}" r="2"/>')
    if scene.command is not None:
        x, y = _at(scene.command)
        for dx, dy in ((3, 0), (0, 3)):
            ends = f'x1="{x - dx:.1f}" y1="{y - dy:.1f}" x2="{x + dx:.1f}" y2="{y + dy:.1f}"'
            parts.append(f'<line class="command" {ends}/>')
    margin = 6.0
    frame = (left - margin, top - margin, right - left + 2 * margin, bottom - top + 2 * margin)
    return _svg(frame, parts)


def _belief(scene: SceneView) -> list[tuple[tuple[float, float], float]]:
    """Points of the belief in degrees, each with an opacity by its weight."""
    heaviest = scene.belief[:, 2].max(initial=1e-12)
    return [(_at(row[:2]), float(row[2] / heaviest)) for row in scene.belief]


def _belief_from_above(scene: SceneView) -> list[str]:
    parts = []
    for row, (_, opacity) in zip(scene.belief, _belief(scene), strict=True):
        x, y = _from_above(_BELIEF_M, row[:2])
        at = f'cx="{x:.3f}" cy="{y:.3f}" r="0.02"'
        parts.append(f'<circle class="belief" fill-opacity="{opacity:.2f}" {at}/>')
    return parts


def _true_place(x: float, y: float, radius: float, attended: bool) -> str:
    name = 'the attended object' if attended else 'an object (truth)'
    at = f'cx="{x:.3f}" cy="{y:.3f}" r="{radius}"'
    kind = 'truth attended' if attended else 'truth'
    return f'<circle class="{kind}" {at}><title>{name}</title></circle>'


def _shown_distance_m(detection: Detection) -> float:
    known = math.isfinite(detection.range_m)
    return min(detection.range_m, _REACH_M) if known else _DISTANCE_M


def _gaze_from_above(x: float, y: float, yaw: float) -> str:
    """Line of the gaze of a face at (x, y): yaw 0 is towards the robot, positive to its left."""
    distance = max(math.hypot(x, y), 1e-9)
    towards, sideways = -np.array([x, y]) / distance, np.array([y, -x]) / distance
    end = np.array([x, y]) + _GAZE_M * (math.cos(yaw) * towards + math.sin(yaw) * sideways)
    ends = f'x1="{x:.3f}" y1="{y:.3f}" x2="{end[0]:.3f}" y2="{end[1]:.3f}"'
    return f'<line class="gaze" {ends}><title>where she looks, as read</title></line>'


def _from_above(distance_m: float, direction: ArrayLike) -> tuple[float, float]:
    """Position on the drawing from above of a point at this direction and distance."""
    pan, tilt = np.asarray(direction, float)
    level_m = distance_m * math.cos(tilt)
    return -level_m * math.sin(pan), -level_m * math.cos(pan)


def _arc(radius_m: float, low_pan: float, high_pan: float) -> str:
    """Path from the right end of an arc about the robot to its left end."""
    (x1, y1), (x2, y2) = (_from_above(radius_m, (pan, 0.0)) for pan in (low_pan, high_pan))
    return f'M {x1:.3f} {y1:.3f} A {radius_m} {radius_m} 0 0 0 {x2:.3f} {y2:.3f}'


def _at(direction: ArrayLike) -> tuple[float, float]:
    """Position on the drawing of postures: left is positive pan, down is positive tilt."""
    pan, tilt = _degrees(direction)
    return -float(pan), float(tilt)


def _degrees(angles: ArrayLike) -> np.ndarray:
    return np.degrees(np.asarray(angles, float))


def _box(kind: str, left: float, top: float, right: float, bottom: float, name: str) -> str:
    size = f'x="{left:.1f}" y="{top:.1f}" width="{right - left:.1f}" height="{bottom - top:.1f}"'
    return f'<rect class="{kind}" {size}><title>{name}</title></rect>'


def _svg(frame: tuple[float, float, float, float], parts: list[str]) -> str:
    box = ' '.join(f'{number:.2f}' for number in frame)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}" width="100%">'
    return f'{head}{_STYLE}{"".join(parts)}</svg>'
