"""Where the things of a film stand, found by the robot's own detector, for a schedule of numbers.

A schedule that was made before the film names things by number only: from left to right, as the
person has put them. In each arrangement the wide film is searched at the times at which she looks
at the camera; the things are the objects that are seen most often, away from her face.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_caregiver.core.film_clips import Picture
from ja_caregiver.core.schedule import Place, Rearrangement, Schedule, ScheduledLook
from ja_common.core.camera_model import CameraModel
from ja_common.core.config import ConfigError
from ja_common.core.detection import objects
from ja_common.core.posture import Posture
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.detector import SalientFeatureDetector

PictureAt = Callable[[float], Picture | None]
"""Returns the wide picture (H, W, 3) uint8 RGB at a time of the schedule [s], or None."""

_SEARCHED_WIDTH = 640
_PICTURES_A_LOOK = 3
_SAME_PLACE = 0.03
_SEEN_SHARE = 0.5


@dataclass
class _Sighted:
    place: NDArray[np.float64]
    times: int = 1
    score: float = 0.0


@dataclass(frozen=True)
class PlacedThings:
    """The places found in one arrangement, and a picture of it to check them by."""

    time_s: float
    places: tuple[Place, ...]
    picture: Picture


def place_things(
    schedule: Schedule, picture_at: PictureAt, view_rad: float
) -> tuple[Schedule, list[PlacedThings]]:
    """Return the schedule with the places of all things, and what was found where.

    Looks whose places are known stay as they are. Arrangements of which the film shows nothing
    stay without places. Raises ConfigError where fewer things are seen than the schedule names.
    """
    segments = list(schedule.segments)
    found: list[PlacedThings] = []
    for group in _arrangements(segments):
        looks = [(index, look) for index, look in group if not look.things]
        if not looks:
            continue
        placed = _search([look for _, look in looks], schedule.things, picture_at, view_rad)
        if placed is None:
            continue
        found.append(placed)
        for index, look in looks:
            segments[index] = replace(look, things=placed.places)
    return replace(schedule, segments=tuple(segments)), found


def draw_places(placed: PlacedThings) -> Picture:
    """Return the picture of an arrangement with the numbers drawn in."""
    picture = placed.picture.copy()
    height, width = picture.shape[:2]
    for number, (u, v) in enumerate(placed.places, 1):
        at = (round(u * width), round(v * height))
        cv2.circle(picture, at, 14, (255, 255, 255), 2, cv2.LINE_AA)
        cv2.putText(
            picture, str(number), (at[0] + 16, at[1] + 6), cv2.FONT_HERSHEY_SIMPLEX, 0.8,
            (255, 255, 255), 2, cv2.LINE_AA,
        )  # fmt: skip
    return picture


def _arrangements(
    segments: Sequence[ScheduledLook | Rearrangement],
) -> Iterator[list[tuple[int, ScheduledLook]]]:
    """Yield the looks between two rearrangements, with their indices."""
    group: list[tuple[int, ScheduledLook]] = []
    for index, segment in enumerate(segments):
        if isinstance(segment, ScheduledLook):
            group.append((index, segment))
        elif group:
            yield group
            group = []
    if group:
        yield group


def _search(
    looks: Sequence[ScheduledLook], things: int, picture_at: PictureAt, view_rad: float
) -> PlacedThings | None:
    """Return the things of one arrangement; None where the film shows nothing of it."""
    detector = SalientFeatureDetector(BlazeFace())
    sighted: list[_Sighted] = []
    pictures: list[Picture] = []
    for look in looks:
        # In the second half she has turned back to the camera, and hands are out of the picture.
        begin_s = (look.camera_s + look.start_s) / 2
        for time_s in np.linspace(begin_s, look.start_s, _PICTURES_A_LOOK).tolist():
            picture = picture_at(time_s)
            if picture is None:
                continue
            pictures.append(_searched(picture))
            seen = _objects(detector, pictures[-1], len(pictures), view_rad)
            _join(sighted, seen)
    if not pictures:
        return None
    often = [each for each in sighted if each.times >= _SEEN_SHARE * len(pictures)]
    often.sort(key=lambda each: each.score, reverse=True)
    if len(often) < things:
        raise ConfigError(
            f'only {len(often)} of {things} things are found in the film at '
            f'{looks[0].camera_s:.1f} s of the schedule: write their places into the column '
            'things of the schedule'
        )
    places = sorted((float(each.place[0]), float(each.place[1])) for each in often[:things])
    return PlacedThings(looks[0].camera_s, tuple(places), pictures[0])


def _objects(
    detector: SalientFeatureDetector, picture: Picture, number: int, view_rad: float
) -> list[tuple[NDArray[np.float64], float]]:
    """Return place and score of each object of a picture."""
    height, width = picture.shape[:2]
    camera = CameraModel.from_field_of_view(width, height, view_rad)
    stamp_ns = number * 100_000_000
    posture = Posture(stamp_ns, np.zeros(2), np.zeros(2))
    found = detector.detect(picture, stamp_ns, camera, posture).detections
    return [
        (np.array([(each.u + 0.5) / width, (each.v + 0.5) / height]), each.score)
        for each in objects(found)
    ]


def _join(sighted: list[_Sighted], seen: list[tuple[NDArray[np.float64], float]]) -> None:
    """Add the objects of one picture to those of the pictures before."""
    for place, score in seen:
        near = [each for each in sighted if math.dist(each.place, place) < _SAME_PLACE]
        if near:
            nearest = min(near, key=lambda each: math.dist(each.place, place))
            nearest.times += 1
            nearest.score += score
        else:
            sighted.append(_Sighted(place, score=score))


def _searched(picture: Picture) -> Picture:
    height, width = picture.shape[:2]
    if width <= _SEARCHED_WIDTH:
        return picture
    size = (_SEARCHED_WIDTH, round(height * _SEARCHED_WIDTH / width))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
