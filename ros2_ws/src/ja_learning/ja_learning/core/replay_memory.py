"""The trials that a learner remembers, to replay them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ja_learning.core.checkpoint_arrays import counts, numbers
from ja_learning.core.trial import FACE_SHAPE

MOST_CANDIDATES = 32
"""Of the objects seen in a trial, at most the first so many are remembered."""


class ReplayMemory:
    """A ring of faces, uint8 (n, 30, 25), and the places seen with them, (n, m, 2), NaN-padded."""

    def __init__(self, capacity: int) -> None:
        """Start empty; a full memory of `capacity` trials drops its oldest."""
        self._capacity = capacity
        self._faces = np.zeros((0, *FACE_SHAPE), np.uint8)
        self._places = np.zeros((0, MOST_CANDIDATES, 2), np.float32)
        self._newest = -1
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def remember_trial(self, face: NDArray[np.uint8], places: NDArray[np.floating]) -> None:
        """Remember a face and the places (m, 2) seen with it; a full memory drops its oldest."""
        if self._count == len(self._faces) < self._capacity:
            self._grow()
        self._newest = (self._newest + 1) % len(self._faces)
        self._count = min(self._count + 1, self._capacity)
        kept = places[:MOST_CANDIDATES]
        self._faces[self._newest] = face
        self._places[self._newest] = np.nan
        self._places[self._newest, : len(kept)] = kept

    def trials_at(self, ages: NDArray[np.int64]) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return faces (..., 30, 25) and places (..., m, 2) of these ages, the newest 0."""
        index = self._index(ages)
        widest = int(self._seen(index).max(initial=0))
        return self._faces[index], self._places[index, :widest]

    def places_at(
        self, ages: NDArray[np.int64], which: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Return one place (..., 2) of each of these ages: `which`, 0-1, of those seen."""
        index = self._index(ages)
        return self._places[index, (which * self._seen(index)).astype(int)]

    def counts(self, newest: int) -> NDArray[np.int64]:
        """Return how many objects were seen in each of so many newest trials."""
        return self._seen(self._index(np.arange(min(newest, self._count))))

    def keep_newest(self, count: int) -> None:
        """Forget all but so many."""
        self._count = min(count, self._count)

    def state(self) -> dict[str, NDArray[Any]]:
        """Return all that is remembered, oldest first, as named arrays."""
        faces, places = self.trials_at(np.arange(self._count)[::-1])
        there = ~np.isnan(places[..., 0])
        return {
            'faces': faces,
            'candidate_counts': there.sum(axis=-1),
            'candidates': places[there],
        }

    @classmethod
    def restored(cls, arrays: dict[str, NDArray[Any]], capacity: int) -> 'ReplayMemory':
        """Make a memory from `state()`; ValueError if it is none."""
        seen_in = counts(arrays, 'candidate_counts')
        if len(seen_in) > capacity or (seen_in > MOST_CANDIDATES).any():
            raise ValueError(
                f'candidate_counts must be at most {capacity}, each up to {MOST_CANDIDATES}'
            )
        faces = numbers(arrays, 'faces', (len(seen_in), *FACE_SHAPE), np.uint8)
        places = numbers(arrays, 'candidates', (int(seen_in.sum()), 2))
        memory = cls(capacity)
        for face, seen in zip(faces, np.split(places, np.cumsum(seen_in))[:-1], strict=True):
            memory.remember_trial(face, seen)
        return memory

    def _index(self, ages: NDArray[np.int64]) -> NDArray[np.int64]:
        return (self._newest - ages) % max(len(self._faces), 1)

    def _seen(self, index: NDArray[np.int64]) -> NDArray[np.int64]:
        return (~np.isnan(self._places[index, :, 0])).sum(axis=-1)

    def _grow(self) -> None:
        more = min(max(64, self._count), self._capacity - self._count)
        faces, places = self.trials_at(np.arange(self._count)[::-1])
        self._faces = np.concatenate([faces, np.zeros((more, *FACE_SHAPE), np.uint8)])
        padded = np.full((self._count + more, MOST_CANDIDATES, 2), np.nan, np.float32)
        padded[: self._count, : places.shape[-2]] = places
        self._places, self._newest = padded, self._count - 1
