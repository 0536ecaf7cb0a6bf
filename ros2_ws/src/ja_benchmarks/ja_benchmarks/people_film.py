"""A wide film of several people who move, as a webcam on a table would take it.

The people are those of the simulator, drawn once for each turn of the head and pasted over a
drawn room. What a webcam adds is added: rows that are exposed one after the other, a picture that
rolls and shakes, exposure that wanders, and compression.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.geometry import rays_of_directions
from ja_common.core.stamps import NS_PER_S
from ja_sim.core.caregiver import (
    HAIR_COLOURS,
    IRIS_COLOURS,
    SHIRT_COLOURS,
    SKIN_TONES,
    Appearance,
    identities,
)
from ja_sim.core.person_renderer import PersonRenderer

Picture = NDArray[np.uint8]

WIDE_PX = (960, 540)
WIDE_VIEW_RAD = math.radians(60)
FOCAL_PX = WIDE_PX[0] / 2 / math.tan(WIDE_VIEW_RAD / 2)
RATE_HZ = 15.0
FACE_M = 0.15
"""Width of a face."""

_CUTOUT_PX = (560, 720)
_CUTOUT_FOCAL_PX = 800.0  # at a distance of 1 m: pixels a metre
_YAW_STEP_RAD = math.radians(10)
_ROW_TIME_S = 0.025  # from the first row of a picture to the last


@dataclass(frozen=True)
class Place:
    """Where a person is: direction of the face (pan, tilt) [rad], distance [m], turn [rad].

    ``yaw``: how far the head is turned from the camera, positive to the person's left.
    """

    pan: float
    tilt: float = 0.0
    distance_m: float = 1.2
    yaw: float = 0.0

    @property
    def direction(self) -> NDArray[np.float64]:
        """Return the direction of the face, (2,) [rad]."""
        return np.array([self.pan, self.tilt])

    @property
    def width_rad(self) -> float:
        """Return the angle that the face fills."""
        return FACE_M / self.distance_m


Path = Callable[[float], Place | None]
"""Where a person is at a time [s]; None while out of the picture."""


@dataclass(frozen=True)
class Thing:
    """A coloured ball: where it is (pan, tilt) [rad], and whether a hand holds it, at a time."""

    colour: tuple[int, int, int]
    path: Callable[[float], tuple[float, float, bool]]
    radius_rad: float = 0.028


@dataclass(frozen=True)
class Camera:
    """What the camera adds to the picture.

    ``exposure``: gain at a time [s]. ``shake``: shift (right, down) [px] and roll [rad] of the
    whole picture at a time. ``jpeg_quality``: 0-100. ``noise``: standard deviation [grey levels].
    """

    exposure: Callable[[float], float] = lambda _: 1.0
    shake: Callable[[float], tuple[float, float, float]] = lambda _: (0.0, 0.0, 0.0)
    jpeg_quality: int = 35
    noise: float = 2.0


@dataclass(frozen=True)
class PeopleFrame:
    """One wide picture (H, W, 3) uint8 RGB, and where the faces are in it.

    ``places``: of each person, the caregiver first; None for one who is out of the picture.
    ``hidden``: whether the caregiver's face is covered by another person.
    """

    picture: Picture
    stamp_ns: int
    places: list[Place | None]
    hidden: bool


@dataclass(frozen=True)
class PeopleFilm:
    """A film: the people, the caregiver first, and for how long it lasts."""

    people: Sequence[tuple[Appearance, Path]]
    seconds: float
    things: Sequence[Thing] = ()
    camera: Camera = field(default_factory=Camera)
    seed: int = 0

    def frames(self) -> Iterator[PeopleFrame]:
        """Yield the frames of the film, the first at one second."""
        rng = np.random.default_rng(self.seed)
        room = _room(self.seed)
        before: list[Place | None] = [None] * len(self.people)
        for number in range(round(self.seconds * RATE_HZ)):
            time_s = number / RATE_HZ
            places = [path(time_s) for _, path in self.people]
            picture = room.astype(np.float32)
            order = [i for i, place in enumerate(places) if place is not None]
            for index in sorted(order, key=lambda i: -_distance(places[i])):
                _paste(picture, self.people[index][0], places[index], before[index])
            for thing in self.things:
                _draw_thing(picture, thing, time_s, self.people[0][0].skin)
            before = places
            taken = self._take(picture, time_s, rng)
            yield PeopleFrame(taken, round((1.0 + time_s) * NS_PER_S), places, _is_hidden(places))

    def _take(
        self, picture: NDArray[np.float32], time_s: float, rng: np.random.Generator
    ) -> Picture:
        """Return what the camera makes of it: shaken row by row, exposed, noisy, compressed."""
        camera = self.camera
        start, end = camera.shake(time_s), camera.shake(time_s + _ROW_TIME_S)
        if any((*start, *end)):
            picture = _roll(picture, start, end)
        noise = rng.normal(0.0, camera.noise, picture.shape[:2]).astype(np.float32)
        exposed = np.clip(picture * camera.exposure(time_s) + noise[..., None], 0, 255)
        return compress(exposed.astype(np.uint8), camera.jpeg_quality)


def compress(picture: Picture, quality: int) -> Picture:
    """Return an RGB picture as JPEG of this quality (0-100) would show it."""
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    _, code = cv2.imencode('.jpg', bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return cv2.cvtColor(cv2.imdecode(code, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)


def draw_people(count: int, rng: np.random.Generator) -> list[Appearance]:
    """Draw people of different faces; skin, hair and shirts at random, equal ones included."""
    names = sorted(identities())
    chosen = rng.permutation(names)[:count]
    return [
        Appearance(
            str(name),
            *(
                colours[int(rng.integers(len(colours)))]
                for colours in (SKIN_TONES, HAIR_COLOURS, IRIS_COLOURS, SHIRT_COLOURS)
            ),
        )
        for name in chosen
    ]


@lru_cache(maxsize=1)
def _person_renderer() -> PersonRenderer:
    return PersonRenderer(_CUTOUT_PX, _CUTOUT_FOCAL_PX)


@lru_cache(maxsize=64)
def _cutout(appearance: Appearance, step: int) -> tuple[Picture, NDArray[np.float32]]:
    return _person_renderer().draw(appearance, step * _YAW_STEP_RAD)


def _distance(place: Place | None) -> float:
    return math.inf if place is None else place.distance_m


def _pixel(direction: ArrayLike) -> NDArray[np.float64]:
    x, y = rays_of_directions((0.0, 0.0), np.asarray(direction, float))
    return np.array([(WIDE_PX[0] - 1) / 2 + FOCAL_PX * x, (WIDE_PX[1] - 1) / 2 + FOCAL_PX * y])


def _paste(
    picture: NDArray[np.float32], appearance: Appearance, place: Place | None, before: Place | None
) -> None:
    """Paste a person; one who moves sideways is sheared, as rows are exposed one by one."""
    if place is None:
        return
    colour, mask = _cutout(appearance, round(place.yaw / _YAW_STEP_RAD))
    scale = FOCAL_PX / _CUTOUT_FOCAL_PX / place.distance_m
    u, v = _pixel(place.direction)
    shear = 0.0
    if before is not None:
        shear = (u - _pixel(before.direction)[0]) * RATE_HZ * _ROW_TIME_S / WIDE_PX[1]
    cu, cv = (_CUTOUT_PX[0] - 1) / 2, (_CUTOUT_PX[1] - 1) / 2
    to_wide = np.array(
        [[scale, shear * scale, u - scale * cu - shear * scale * cv], [0, scale, v - scale * cv]]
    )
    # Only where the person is: the wide picture is large.
    half = np.array([scale * (cu + abs(shear) * cv), scale * cv]) + 2
    left, top = np.clip(np.floor([u, v] - half), 0, WIDE_PX).astype(int)
    right, bottom = np.clip(np.ceil(np.add(half, [u, v])), 0, WIDE_PX).astype(int)
    if right <= left or bottom <= top:
        return
    to_wide[:, 2] -= (left, top)
    size = (int(right - left), int(bottom - top))
    alpha = cv2.warpAffine(mask, to_wide, size)[..., None]
    region = picture[top:bottom, left:right]
    region += alpha * (cv2.warpAffine(colour, to_wide, size) - region)


def _draw_thing(
    picture: NDArray[np.float32], thing: Thing, time_s: float, skin: tuple[float, float, float]
) -> None:
    pan, tilt, held = thing.path(time_s)
    u, v = _pixel((pan, tilt))
    radius = FOCAL_PX * thing.radius_rad
    if held:
        flesh = tuple(200.0 * value for value in skin)
        wrist = (round(u + 3.0 * radius), round(v + 7.0 * radius))
        cv2.line(picture, (round(u), round(v + radius)), wrist, flesh, round(1.4 * radius))
        cv2.circle(picture, (round(u), round(v + radius)), round(1.3 * radius), flesh, -1)
    cv2.circle(picture, (round(u), round(v)), round(radius), thing.colour, -1, cv2.LINE_AA)


def _roll(
    picture: NDArray[np.float32],
    start: tuple[float, float, float],
    end: tuple[float, float, float],
) -> NDArray[np.float32]:
    """Return a shaken picture: its first row as at the start, its last one as at the end."""
    rows, columns = np.mgrid[0 : WIDE_PX[1], 0 : WIDE_PX[0]].astype(np.float32)
    share = rows / WIDE_PX[1]
    right, down, roll = (a + (b - a) * share for a, b in zip(start, end, strict=True))
    du, dv = columns - WIDE_PX[0] / 2 - right, rows - WIDE_PX[1] / 2 - down
    u = WIDE_PX[0] / 2 + du * np.cos(roll) + dv * np.sin(roll)
    v = WIDE_PX[1] / 2 - du * np.sin(roll) + dv * np.cos(roll)
    return cv2.remap(
        picture,
        u.astype(np.float32),
        v.astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )


def _is_hidden(places: list[Place | None]) -> bool:
    hers = places[0]
    if hers is None:
        return True
    return any(
        other is not None
        and other.distance_m < hers.distance_m
        and abs(other.pan - hers.pan) < 0.6 * (other.width_rad + 0.5 * hers.width_rad)
        for other in places[1:]
    )


@lru_cache(maxsize=4)
def _room(seed: int) -> Picture:
    """Return a wall with pale rectangles and a table, without a face."""
    rng = np.random.default_rng(1000 + seed)
    room = np.full((WIDE_PX[1], WIDE_PX[0], 3), (176, 172, 166), np.uint8)
    for _ in range(14):
        left, top = rng.integers(0, WIDE_PX)
        width, height = rng.integers(40, 200, 2)
        colour = (
            rng.uniform(0.75, 1.1) * np.array([170, 166, 160]) + rng.normal(0, 6, 3)
        ).tolist()
        cv2.rectangle(
            room, (int(left), int(top)), (int(left + width), int(top + height)), colour, -1
        )
    table = round(0.82 * WIDE_PX[1])
    room[table:] = (120, 104, 90)
    return np.clip(cv2.GaussianBlur(room, (5, 5), 0), 0, 255).astype(np.uint8)
