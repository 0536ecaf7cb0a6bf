"""Track numbers that stay while the head turns, and a target that does not flicker."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import Configuration, parameter
from ja_common.core.stamps import NS_PER_S


@dataclass(frozen=True)
class TrackingConfig(Configuration):
    """When two detections are of the same object, and how firmly a target is held."""

    same_object_within_rad: float = parameter(
        0.06, 'farthest that an object moves between two detections', low=0.0, high=1.0
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
    toward: list[float]
    seen_ns: int


class ObjectTracker:
    """Follows objects by their direction from the base, which the head does not turn."""

    def __init__(self, config: TrackingConfig) -> None:
        self._config = config
        self._tracks: list[_Track] = []
        self._next_id = 0
        self._target_id: int | None = None
        self._target_ns = 0

    def update(self, vectors: ArrayLike, stamp_ns: int) -> list[int]:
        """Return the track numbers of the objects seen now along base-frame ``vectors`` (n, 3)."""
        vectors = np.asarray(vectors, float).reshape(-1, 3)
        toward = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
        forget_ns = self._config.forget_object_after_s * NS_PER_S
        # abs: after a clock was set back, tracks are dropped as well.
        self._tracks = [t for t in self._tracks if abs(stamp_ns - t.seen_ns) <= forget_ns]
        track_of = self._nearest_first(toward)
        ids = []
        for row, unit in enumerate(toward.tolist()):
            track = track_of.get(row)
            if track is None:
                track = _Track(self._next_id, unit, stamp_ns)
                self._tracks.append(track)
                self._next_id += 1
            track.toward, track.seen_ns = unit, stamp_ns
            ids.append(track.track_id)
        return ids

    def apply_hysteresis(self, ids: list[int], scores: list[float], stamp_ns: int) -> list[float]:
        """Return the scores, with the present target's raised while it stays in view."""
        raised = [
            score * (1 + self._config.hysteresis * (i == self._target_id))
            for i, score in zip(ids, scores, strict=True)
        ]
        if raised and max(raised) > 0:
            self._target_id = ids[raised.index(max(raised))]
            self._target_ns = stamp_ns
        elif abs(stamp_ns - self._target_ns) > self._config.forget_object_after_s * NS_PER_S:
            self._target_id = None
        return raised

    def _nearest_first(self, toward: NDArray[np.float64]) -> dict[int, _Track]:
        """Return each object's track: the nearest pairs first, each object and track once."""
        if not self._tracks or not len(toward):
            return {}
        cosines = toward @ np.array([track.toward for track in self._tracks]).T
        rows, columns = np.nonzero(cosines >= math.cos(self._config.same_object_within_rad))
        near = zip(cosines[rows, columns].tolist(), rows.tolist(), columns.tolist(), strict=True)
        track_of: dict[int, _Track] = {}
        taken: set[int] = set()
        for _, row, column in sorted(near, reverse=True):
            if row not in track_of and column not in taken:
                track_of[row] = self._tracks[column]
                taken.add(column)
        return track_of
