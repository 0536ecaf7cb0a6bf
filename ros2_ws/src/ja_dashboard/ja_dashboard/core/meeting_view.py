"""A meeting with a real caregiver as the page shows it: no ROS and no web here.

What the scorer publishes are texts. A value that is missing or odd is left out, and the others are
shown.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.geometry import rays_of_directions
from ja_common.core.request_phase import RequestPhase

SILENT_AFTER_S = 3.0
"""The scorer counts as silent after this time [s]: it publishes at 2 Hz."""
_LONGEST_MESSAGE = 200
_LONGEST_PATH = 1000
_MOST_THINGS = 40
_NUMBER = re.compile(r'[0-9]{1,6}', re.ASCII)
_REPORT = 'report.html'
_MEETING = 'meeting.json'
_LARGEST_REPORT = 50_000_000
_INSET = 0.06
"""Distance of the marks of things outside the picture from its edge, in parts of the picture."""
_GAP = 0.13
"""Least distance between two such marks at one edge, in parts of the picture."""
_SAME_RAY = 0.02


@dataclass(frozen=True)
class NumberedThing:
    """A thing that the head sees, with the number that it keeps, at (pan, tilt) [rad]."""

    number: int
    direction: tuple[float, float]


@dataclass(frozen=True)
class LearnerFigure:
    """How often the learner alone was right, with the 95 % interval of its rate."""

    successes: int
    trials: int
    interval: tuple[float, float]


@dataclass(frozen=True)
class MeetingView:
    """What the scorer has last published; None and '' for what it did not state.

    `number` is the thing that the person is asked to look at, `answer` the one that the head
    fixated. `chance` is the rate of choosing any thing. `report` is a path on the machine of the
    scorer. `silent_s`: since the message.
    """

    phase: RequestPhase = RequestPhase.STARTING
    message: str = ''
    number: int | None = None
    trial: int | None = None
    trials: int | None = None
    answer: int | None = None
    right: bool | None = None
    learner: LearnerFigure | None = None
    successes: int | None = None
    chance: float | None = None
    things: tuple[NumberedThing, ...] = ()
    report: str = ''
    film: bool = False
    silent_s: float = 0.0

    @classmethod
    def of(cls, message: str, values: Mapping[str, str]) -> 'MeetingView':
        """Read the message and the values of a status; what is odd is left out."""
        return cls(
            phase=_phase(values.get('phase', '')),
            message=message[:_LONGEST_MESSAGE],
            number=_count(values.get('number')),
            trial=_count(values.get('trial')),
            trials=_count(values.get('trials')),
            answer=_count(values.get('answer')),
            right={'true': True, 'false': False}.get(values.get('right', '')),
            learner=_learner(values),
            successes=_count(values.get('successes')),
            chance=_share(values.get('chance')),
            things=_things(values.get('things', '')),
            report=values.get('report', '')[:_LONGEST_PATH],
            film=values.get('film') == 'true',
        )

    @property
    def is_silent(self) -> bool:
        """Return whether the scorer should have published since; one that has ended need not."""
        return self.phase is not RequestPhase.ENDED and self.silent_s > SILENT_AFTER_S


@dataclass(frozen=True)
class Mark:
    """The number of a thing in the picture, at (x, y) in parts of its width and height.

    `outside`: the thing lies beyond the edge of the picture, in the direction `angle_deg` (0 to
    the right, 90 downwards); the mark stands at the edge.
    """

    number: int
    x: float
    y: float
    outside: bool = False
    angle_deg: float = 0.0


def marks_in_picture(
    things: Sequence[NumberedThing], posture: ArrayLike, camera: CameraModel
) -> list[Mark]:
    """Return where the numbers of things stand in a picture that was taken at a posture [rad]."""
    if not things:
        return []
    directions = np.array([thing.direction for thing in things])
    rays = rays_of_directions(posture, directions)
    marks, beyond = [], []
    for thing, ray in zip(things, rays, strict=True):
        place = _place(ray, camera)
        if place is not None:
            marks.append(Mark(thing.number, *place))
        else:
            beyond.append((thing, _towards(ray, thing, posture)))
    return marks + _at_the_edges(beyond, camera.width / camera.height)


def report_file(text: str) -> Path | None:
    """Return the file of a report if it lies on this machine; None for any other file.

    The path comes from a message, and the page shows the file to each of its viewers: only the
    report in the folder of a meeting is one.
    """
    if not text or '\0' in text:
        return None
    try:
        path = Path(text).resolve(strict=True)
        is_report = path.name == _REPORT and path.is_file()
        in_meeting = path.with_name(_MEETING).is_file()
        return path if is_report and in_meeting and path.stat().st_size < _LARGEST_REPORT else None
    except (OSError, RuntimeError):
        return None


def _phase(text: str) -> RequestPhase:
    return next((phase for phase in RequestPhase if phase.value == text), RequestPhase.STARTING)


def _count(text: str | None) -> int | None:
    return int(text) if text is not None and _NUMBER.fullmatch(text) else None


def _number(text: str | None) -> float | None:
    try:
        value = float(text or '')
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _share(text: str | None) -> float | None:
    value = _number(text)
    return value if value is not None and 0 <= value <= 1 else None


def _learner(values: Mapping[str, str]) -> LearnerFigure | None:
    successes, trials = (
        _count(values.get('learner_successes')),
        _count(values.get('learner_trials')),
    )
    ends = [_share(text) for text in values.get('learner_interval', '').split()]
    if not trials or successes is None or successes > trials or len(ends) != 2:
        return None
    low, high = ends
    if low is None or high is None or low > high:
        return None
    return LearnerFigure(successes, trials, (low, high))


def _things(text: str) -> tuple[NumberedThing, ...]:
    things: dict[int, NumberedThing] = {}
    for row in text.split(';')[:_MOST_THINGS]:
        number, pan, tilt = [*row.split(), '', '', ''][:3]
        known, direction = _count(number), (_number(pan), _number(tilt))
        if known is not None and direction[0] is not None and direction[1] is not None:
            things[known] = NumberedThing(known, (direction[0], direction[1]))
    return tuple(things.values())


def _place(ray: NDArray[np.float64], camera: CameraModel) -> tuple[float, float] | None:
    """Return where a ray meets the picture, in parts of it; None where it does not."""
    if not np.isfinite(ray).all():
        return None
    pixel = camera.pixels(ray)
    if not camera.contains(pixel):
        return None
    # Far from its axis a lens model folds back into the picture.
    if camera.lens is not None and not np.allclose(camera.rays(pixel), ray, atol=_SAME_RAY):
        return None
    return (float(pixel[0]) + 0.5) / camera.width, (float(pixel[1]) + 0.5) / camera.height


def _towards(
    ray: NDArray[np.float64], thing: NumberedThing, posture: ArrayLike
) -> NDArray[np.float64]:
    """Return the direction (right, down) in the picture in which a thing outside it lies."""
    if np.isfinite(ray).all() and np.any(ray):
        return ray
    pan = float(np.asarray(posture)[0])
    behind = math.remainder(thing.direction[0] - pan, math.tau)
    return np.array([-math.copysign(1.0, behind), 0.0])


def _at_the_edges(
    things: Sequence[tuple[NumberedThing, NDArray[np.float64]]], aspect: float
) -> list[Mark]:
    """Return marks at the edges; those of one edge keep a distance from each other."""
    edges: dict[str, list[tuple[float, float, NumberedThing]]] = {}
    reach = 0.5 - _INSET
    for thing, (right, down) in things:
        x, y = right / aspect, down
        scale = reach / max(abs(x), abs(y))
        angle = math.degrees(math.atan2(down, right))
        if abs(x) >= abs(y):
            edges.setdefault('right' if x > 0 else 'left', []).append((y * scale, angle, thing))
        else:
            edges.setdefault('bottom' if y > 0 else 'top', []).append((x * scale, angle, thing))
    marks = []
    for edge, found in edges.items():
        found.sort(key=lambda each: (each[0], each[2].number))
        along = _spread([each[0] for each in found], reach)
        far = 0.5 + (reach if edge in ('right', 'bottom') else -reach)
        for place, (_, angle, thing) in zip(along, found, strict=True):
            near = 0.5 + place
            x, y = (far, near) if edge in ('left', 'right') else (near, far)
            marks.append(Mark(thing.number, x, y, outside=True, angle_deg=angle))
    return marks


def _spread(places: Sequence[float], reach: float) -> list[float]:
    """Return ascending places, moved apart within -reach to reach as far as there is room."""
    gap = min(_GAP, 2 * reach / max(len(places) - 1, 1))
    spread: list[float] = []
    for place in places:
        spread.append(max(place, spread[-1] + gap if spread else -reach))
    limit = reach
    for index in reversed(range(len(spread))):
        spread[index] = min(spread[index], limit)
        limit = spread[index] - gap
    return spread
