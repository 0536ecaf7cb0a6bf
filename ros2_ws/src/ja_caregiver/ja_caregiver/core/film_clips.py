"""Clips of a film: the pictures of one look of a schedule, at the rate of the head's images."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_caregiver.core.schedule import Place, ScheduledLook
from ja_common.core.camera_model import CameraModel
from ja_common.core.config import ConfigError
from ja_common.core.geometry import directions_of_rays
from ja_perception.core.frame_sources import FrameSource, SourceError, Warn

Picture = NDArray[np.uint8]

_ROUNDING_S = 1e-6
_MOST_BROKEN = 100


@dataclass(frozen=True)
class Clip:
    """The pictures (H, W, 3) uint8 RGB of one look, in the order of time.

    In the first `camera_pictures` of them she has not yet been asked.
    """

    look: ScheduledLook
    pictures: tuple[Picture, ...]
    camera_pictures: int


class ClipReader:
    """Reads the clips of a film one after the other; the film is read forward, once.

    A clip shows the last `shown_s` [s] of a look, `rate_hz` pictures a second. `offset_s`: where
    in the film the schedule's time zero is. `largest_width` [px]: a wider film is made smaller.
    `warn`: receives what cannot be decoded.
    """

    def __init__(
        self,
        source: FrameSource,
        warn: Warn,
        *,
        rate_hz: float,
        shown_s: float,
        offset_s: float = 0.0,
        largest_width: Callable[[int], int] = lambda width: width,
    ) -> None:
        self._source, self._warn = source, warn
        self._step_s, self._shown_s = 1 / rate_hz, shown_s
        self._offset_s, self._largest_width = offset_s, largest_width
        self._newest: Picture | None = None
        self._next_s, self._broken = 0.0, 0

    @property
    def read_s(self) -> float:
        """Return the time up to which the film has been read [s]."""
        return self._next_s

    def read_clip(self, look: ScheduledLook) -> Clip | None:
        """Return the clip of a look, which must be later than those before.

        None where the film ends before the look does, or begins after it.
        """
        begin_s = max(look.camera_s, look.end_s - self._shown_s) + self._offset_s
        count = max(2, round((look.end_s + self._offset_s - begin_s) / self._step_s))
        times = begin_s + self._step_s * np.arange(count)
        pictures = []
        for time_s in times.tolist():
            picture = self._picture_at(time_s)
            if picture is None:
                return None
            pictures.append(picture)
        before = int(np.count_nonzero(times < look.start_s + self._offset_s))
        return Clip(look, tuple(pictures), max(1, before))

    def close(self) -> None:
        """Release the film."""
        self._source.close()

    def _picture_at(self, time_s: float) -> Picture | None:
        """Return the picture that the film shows at a time; None outside of the film."""
        if time_s < 0.0:
            return None
        shown: Picture | None = None
        while self._next_s <= time_s + _ROUNDING_S:
            try:
                found = self._source.next_frame()
            except SourceError as error:
                self._warn('film', str(error))
                self._broken += 1
                if self._broken > _MOST_BROKEN:
                    return None
            else:
                if found is None:
                    return None
                shown = found
            self._next_s += self._source.period_s
        if shown is not None:
            self._newest = self._resized(shown)
        return self._newest

    def _resized(self, picture: Picture) -> Picture:
        height, width = picture.shape[:2]
        largest = self._largest_width(width)
        if width <= largest:
            return picture
        size = (largest, max(1, round(height * largest / width)))
        return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


@dataclass(frozen=True)
class FilmFacts:
    """Width and height [px] of a film as it is shown, and its length [s]; inf where unknown."""

    width: int
    height: int
    length_s: float


def film_facts(path: Path) -> FilmFacts:
    """Return what a film is like. Raises ConfigError where it is none that can be read."""
    if not path.is_file():
        raise ConfigError(f"no such film: '{path}'")
    capture = cv2.VideoCapture(str(path))
    try:
        got, picture = capture.read()
        if not got:
            raise ConfigError(
                f"'{path}' cannot be read as a film: is it complete, and of a format that ffplay "
                'shows?'
            )
        rate, count = capture.get(cv2.CAP_PROP_FPS), capture.get(cv2.CAP_PROP_FRAME_COUNT)
    finally:
        capture.release()
    height, width = picture.shape[:2]
    known = math.isfinite(rate) and rate > 0 and count > 0
    return FilmFacts(width, height, count / rate if known else math.inf)


def directions_of_places(
    places: tuple[Place, ...], size: tuple[int, int], view_rad: float
) -> NDArray[np.float64]:
    """Return the directions (n, 2) [rad] of places in a wide picture of (width, height) [px].

    `view_rad`: its horizontal view. At posture (0, 0) the head looks at its centre.
    """
    width, height = size
    camera = CameraModel.from_field_of_view(width, height, view_rad)
    pixels = np.array(places, float).reshape(-1, 2) * (width, height) - 0.5
    return directions_of_rays(np.zeros(2), camera.rays(pixels))


def places_of_directions(
    directions: NDArray[np.float64], size: tuple[int, int], view_rad: float
) -> NDArray[np.float64]:
    """Return the places (n, 2) of directions (n, 2) [rad]: the inverse of `directions_of_places`.

    Raises ValueError for a direction that lies outside of the picture.
    """
    width, height = size
    camera = CameraModel.from_field_of_view(width, height, view_rad)
    vectors = np.tan(directions)
    rays = np.stack([-vectors[:, 0], vectors[:, 1] / np.cos(directions[:, 0])], axis=1)
    places = (camera.pixels(rays) + 0.5) / (width, height)
    inside = (np.abs(directions[:, 0]) < np.pi / 2) & np.all((places >= 0) & (places <= 1), axis=1)
    if not inside.all():
        raise ValueError('a thing stands outside of the wide picture')
    return places
