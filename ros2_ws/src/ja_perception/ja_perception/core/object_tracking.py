"""Numbers for objects that last while the head turns, and a target that does not flicker."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import parameter
from ja_common.core.geometry import angle_between
from ja_common.core.posture import NS_PER_S


@dataclass(frozen=True)
class TrackingConfig:
    """When two sightings are of the same thing, and how firmly a target is held."""

    same_object_within_rad: float = parameter(
        0.06, 'farthest that an object moves between two sightings', low=0.0, high=1.0
    )
    forget_object_after_s: float = parameter(
        2.0, 'time after which an object not seen again gets a new number', low=0.0, high=60.0
    )
    hysteresis: float = parameter(
        0.15, 'share by which another object must be more salient to become the target',
        low=0.0, high=10.0,
    )  # fmt: skip


@dataclass
class _Track:
    track_id: int
    direction: NDArray[np.float64]
    seen_ns: int


class ObjectTracker:
    """Follows objects by their direction from the base, which the head does not turn."""

    def __init__(self, config: TrackingConfig) -> None:
        self._config = config
        self._tracks: list[_Track] = []
        self._next_id = 0
        self._target_id: int | None = None
        self._target_ns = 0

    def update(self, directions: ArrayLike, stamp_ns: int) -> list[int]:
        """Track numbers of the objects seen now in ``directions``, shape (n, 2) [rad]."""
        directions = np.asarray(directions, float).reshape(-1, 2)
        forget_ns = self._config.forget_object_after_s * NS_PER_S
        # abs: a clock that was set back forgets as well.
        self._tracks = [t for t in self._tracks if abs(stamp_ns - t.seen_ns) <= forget_ns]
        ids = [-1] * len(directions)
        for row, column in self._nearest_first(directions):
            track = self._tracks[column]
            ids[row] = track.track_id
            track.direction, track.seen_ns = directions[row], stamp_ns
        for row, direction in enumerate(directions):
            if ids[row] < 0:
                ids[row] = self._next_id
                self._tracks.append(_Track(self._next_id, direction, stamp_ns))
                self._next_id += 1
        return ids

    def held(self, ids: list[int], scores: list[float], stamp_ns: int) -> list[float]:
        """Scores with the hysteresis: the present target's is raised while it stays in view."""
        raised = [
            score * (1 + self._config.hysteresis * (i == self._target_id))
            for i, score in zip(ids, scores, strict=True)
        ]
        if raised and max(raised) > 0:
            self._target_id = ids[int(np.argmax(raised))]
            self._target_ns = stamp_ns
        elif abs(stamp_ns - self._target_ns) > self._config.forget_object_after_s * NS_PER_S:
            self._target_id = None
        return raised

    def _nearest_first(self, directions: NDArray[np.float64]) -> list[tuple[int, int]]:
        """Pairs (object, track), nearest first, each of both at most once."""
        if not self._tracks or not len(directions):
            return []
        known = np.array([track.direction for track in self._tracks])
        angles = angle_between(directions[:, None], known[None])
        near = np.argwhere(angles <= self._config.same_object_within_rad)
        order = np.argsort(angles[tuple(near.T)], kind='stable')
        pairs: dict[int, int] = {}
        taken: set[int] = set()
        for row, column in near[order].tolist():
            if row not in pairs and column not in taken:
                pairs[row] = column
                taken.add(column)
        return list(pairs.items())
