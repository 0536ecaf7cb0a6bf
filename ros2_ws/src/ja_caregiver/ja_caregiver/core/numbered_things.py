"""The things that the head sees, each with a number that stays.

A thing is a direction in the base frame. The head sees a part of the scene at a time, and a number
must not change when the head turns away and back: what is out of view stays known.
"""

from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import Configuration, parameter
from ja_common.core.geometry import angle_between, rays_of_directions
from ja_common.core.posture import STILL_BELOW_RAD_S, Posture
from ja_common.core.stamps import NS_PER_S

Direction = tuple[float, float]
"""Pan and tilt [rad] in the base frame."""

_SAME_POSTURE_RAD = 0.02
# Between two images farther apart in time, nothing is known about what was in view.
_LONGEST_STEP_S = 0.25
# What was never given a number is forgotten sooner.
_NOISE_GONE_AFTER_S = 0.3
_NEWEST_SHARE = 0.5
_MOST_PLACES = 100
_WIDEST_HALF_VIEW_RAD = 1.4


@dataclass(frozen=True)
class NumberedThingsConfig(Configuration):
    """When two sightings are of one thing, and when a thing appears and disappears."""

    same_thing_rad: float = parameter(
        0.08, 'what is seen nearer than this to where a thing was last is that thing',
        low=0.01, high=0.5,
    )  # fmt: skip
    confirmed_after_s: float = parameter(
        0.7,
        'a thing gets its number once it was seen for so long, or from two postures at rest',
        low=0.0, high=10.0,
    )  # fmt: skip
    gone_after_s: float = parameter(
        3.0, 'a thing that is not seen for so long, where it is well in view, has gone',
        low=0.1, high=60.0,
    )  # fmt: skip
    well_in_view: float = parameter(
        0.8, 'share of the view, from its centre, in which a thing cannot be overlooked',
        low=0.1, high=1.0,
    )  # fmt: skip
    still_below_rad_s: float = parameter(
        STILL_BELOW_RAD_S, 'a joint slower than this stands still', low=1e-4, high=5.0
    )


@dataclass(eq=False)
class _Place:
    direction: NDArray[np.float64]
    rest: int
    number: int | None = None
    rests: int = 1
    seen_s: float = 0.0
    missing_s: float = 0.0


class NumberedThings:
    """Gives numbers 1, 2, ... to what stands still or is moved slowly, and keeps them.

    Only images of a head at rest count: while it turns, a direction is known less well. A thing
    that is moved keeps its number while each image shows it nearer than `same_thing_rad` to where
    the last one did; otherwise it is a new thing with a new number.
    """

    def __init__(
        self, config: NumberedThingsConfig, half_view_rad: tuple[float, float] = (0.31, 0.24)
    ) -> None:
        """Start with no thing. `half_view_rad`: half of the view across and down [rad]."""
        self.config = config
        self.half_view_rad = half_view_rad
        self._places: list[_Place] = []
        self._numbers = count(1)
        self._rests_at: NDArray[np.float64] | None = None
        self._rest = 0
        self._stamp_ns = 0

    @property
    def directions(self) -> dict[int, Direction]:
        """Return where each numbered thing is, by its number, in rising order."""
        numbered = [place for place in self._places if place.number is not None]
        return {
            place.number: (float(place.direction[0]), float(place.direction[1]))
            for place in sorted(numbered, key=lambda each: each.number or 0)
            if place.number is not None
        }

    def restart(self) -> None:
        """Forget all things, and count from 1 again: they stand elsewhere now."""
        self._places.clear()
        self._numbers = count(1)

    def observe_image(self, posture: Posture, directions: ArrayLike) -> None:
        """Take the objects (n, 2) [rad] that one image shows, and the posture at its stamp."""
        if not posture.is_still(self.config.still_below_rad_s):
            self._rests_at = None
            return
        step_s = self._step_s(posture)
        seen = np.asarray(directions, float).reshape(-1, 2)
        pairs = self._pairs(seen)
        for place, index in pairs:
            self._record_sighting(place, seen[index], step_s)
        missing = set(self._places) - {place for place, _ in pairs}
        for place in missing:
            if self._is_well_in_view(place, posture):
                place.missing_s += step_s
        self._places = [place for place in self._places if not self._has_gone(place)]
        matched = {index for _, index in pairs}
        self._places += [
            _Place(seen[index], self._rest) for index in range(len(seen)) if index not in matched
        ]
        self._places = self._places[:_MOST_PLACES]
        self._give_numbers()

    def _step_s(self, posture: Posture) -> float:
        """Return the time [s] since the last image of the same rest; 0 for the first."""
        stamp_ns, self._stamp_ns = self._stamp_ns, posture.stamp_ns
        before, self._rests_at = self._rests_at, posture.position
        if before is None or np.abs(before - posture.position).max() > _SAME_POSTURE_RAD:
            self._rest += 1
            return 0.0
        return min(max((posture.stamp_ns - stamp_ns) / NS_PER_S, 0.0), _LONGEST_STEP_S)

    def _pairs(self, seen: NDArray[np.float64]) -> list[tuple[_Place, int]]:
        """Pair known places with sightings (n, 2) [rad], the nearest first."""
        if not self._places or not len(seen):
            return []
        known = np.array([place.direction for place in self._places])
        angles = angle_between(known[:, np.newaxis], seen[np.newaxis])
        pairs = []
        while angles.min() < self.config.same_thing_rad:
            row, column = np.unravel_index(angles.argmin(), angles.shape)
            pairs.append((self._places[int(row)], int(column)))
            angles[row], angles[:, column] = np.inf, np.inf
        return pairs

    def _record_sighting(
        self, place: _Place, direction: NDArray[np.float64], step_s: float
    ) -> None:
        place.direction = place.direction + _NEWEST_SHARE * (direction - place.direction)
        place.seen_s += step_s
        place.missing_s = 0.0
        if place.rest != self._rest:
            place.rest, place.rests = self._rest, place.rests + 1

    def _is_well_in_view(self, place: _Place, posture: Posture) -> bool:
        ray = rays_of_directions(posture.position, place.direction)  # NaN behind the camera
        half_view = np.minimum(self.half_view_rad, _WIDEST_HALF_VIEW_RAD)
        edge = self.config.well_in_view * np.tan(half_view)
        return bool((np.abs(ray) < edge).all())

    def _has_gone(self, place: _Place) -> bool:
        patience_s = self.config.gone_after_s
        if place.number is None:
            patience_s = min(patience_s, _NOISE_GONE_AFTER_S)
        return place.missing_s >= patience_s

    def _give_numbers(self) -> None:
        """Give the next numbers to the things that are confirmed now, from left to right."""
        confirmed = [
            place
            for place in self._places
            if place.number is None
            and (place.rests > 1 or place.seen_s >= self.config.confirmed_after_s)
        ]
        for place in sorted(confirmed, key=lambda each: -each.direction[0]):
            place.number = next(self._numbers)


def nearest_thing(
    things: dict[int, Direction], direction: ArrayLike, within_rad: float = np.inf
) -> int | None:
    """Return the number of the thing nearest to a direction (2,) [rad]; None if none is within."""
    if not things:
        return None
    angles = angle_between(np.array(list(things.values())), direction)
    nearest = int(np.argmin(angles))
    return list(things)[nearest] if angles[nearest] < within_rad else None
