"""The trials that a learner remembers, to replay them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ja_learning.core.checkpoint_arrays import counts, numbers
from ja_learning.core.gaze_line_places import IN_VIEW, PLACE_COLUMNS, known_from_eyes
from ja_learning.core.trial import PICTURE, FaceFormat

_FROM_EYES = slice(2, PLACE_COLUMNS)

MOST_CANDIDATES = 32
"""Of the objects seen in a trial, at most the first so many are remembered."""


class ReplayMemory:
    """A ring of faces and the places seen with them, (n, m, 8), NaN-padded.

    A face is what the learner reads of it; the columns of places are those of `gaze_line_places`.
    """

    def __init__(self, capacity: int, faces: FaceFormat = PICTURE) -> None:
        """Start empty; a full memory of `capacity` trials drops its oldest."""
        self._capacity, self._format = capacity, faces
        self._faces: NDArray[Any] = np.zeros((0, *faces.shape), faces.dtype)
        self._places = np.zeros((0, MOST_CANDIDATES, PLACE_COLUMNS), np.float32)
        self._newest = -1
        self._count = 0

    @property
    def capacity(self) -> int:
        """Return how many trials it keeps at most."""
        return self._capacity

    def __len__(self) -> int:
        return self._count

    def remember_trial(self, face: NDArray[Any], places: NDArray[np.floating]) -> None:
        """Remember a face and the places (m, 8) seen with it; a full memory drops its oldest."""
        if self._count == len(self._faces) < self._capacity:
            self._grow()
        self._newest = (self._newest + 1) % len(self._faces)
        self._count = min(self._count + 1, self._capacity)
        kept = places[:MOST_CANDIDATES]
        self._faces[self._newest] = face
        self._places[self._newest] = np.nan
        self._places[self._newest, : len(kept)] = kept

    def trials_at(self, ages: NDArray[np.int64]) -> tuple[NDArray[Any], NDArray[np.float32]]:
        """Return faces, as they are read, and places (..., m, 8) of these ages, the newest 0."""
        faces, places = self._kept_at(ages)
        return self._read(faces, ages), places

    def places_at(
        self, ages: NDArray[np.int64], which: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Return one place (..., 8) of each of these ages: `which`, 0-1, of those seen."""
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
        faces, places = self._kept_at(np.arange(self._count)[::-1])
        there = ~np.isnan(places[..., 0])
        seen = places[there]
        known = known_from_eyes(seen)
        arrays = {
            'faces': faces,
            'candidate_counts': there.sum(axis=-1),
            'candidates': seen[:, IN_VIEW],
        }
        if known.any():  # no number of a state is NaN
            arrays['candidates_with_range'] = np.flatnonzero(known)
            arrays['candidates_from_eyes'] = seen[known][:, _FROM_EYES]
        return arrays

    @classmethod
    def restored(
        cls, arrays: dict[str, NDArray[Any]], capacity: int, faces: FaceFormat = PICTURE
    ) -> 'ReplayMemory':
        """Make a memory from `state()`; ValueError if it is none of such faces."""
        memory = cls(capacity, faces)
        memory._take(arrays)
        return memory

    def _take(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Remember the trials of `state()`, in an empty memory; ValueError if it is none."""
        capacity, faces = self._capacity, self._format
        seen_in = counts(arrays, 'candidate_counts')
        if len(seen_in) > capacity or (seen_in > MOST_CANDIDATES).any():
            raise ValueError(
                f'candidate_counts must be at most {capacity}, each up to {MOST_CANDIDATES}'
            )
        remembered = numbers(arrays, 'faces', (len(seen_in), *faces.shape), faces.dtype)
        in_all = int(seen_in.sum())
        places = np.full((in_all, PLACE_COLUMNS), np.nan, np.float32)
        places[:, IN_VIEW] = numbers(arrays, 'candidates', (in_all, 2))
        if 'candidates_with_range' in arrays:
            index = counts(arrays, 'candidates_with_range')
            if (index >= in_all).any():
                raise ValueError(f'candidates_with_range must be below {in_all}')
            columns = PLACE_COLUMNS - 2
            places[index, _FROM_EYES] = numbers(
                arrays, 'candidates_from_eyes', (len(index), columns)
            )
        for face, seen in zip(remembered, np.split(places, np.cumsum(seen_in))[:-1], strict=True):
            self.remember_trial(face, seen)

    def _kept_at(self, ages: NDArray[np.int64]) -> tuple[NDArray[Any], NDArray[np.float32]]:
        """Return faces as they are kept, and places (..., m, 8), of these ages."""
        index = self._index(ages)
        widest = int(self._seen(index).max(initial=0))
        return self._faces[index], self._places[index, :widest]

    def _read(self, faces: NDArray[Any], ages: NDArray[np.int64]) -> NDArray[Any]:
        """Return the faces of these ages as the learner reads them."""
        return faces

    def _index(self, ages: NDArray[np.int64]) -> NDArray[np.int64]:
        return (self._newest - ages) % max(len(self._faces), 1)

    def _seen(self, index: NDArray[np.int64]) -> NDArray[np.int64]:
        return (~np.isnan(self._places[index, :, 0])).sum(axis=-1)

    def _grow(self) -> None:
        more = min(max(64, self._count), self._capacity - self._count)
        faces, places = self._kept_at(np.arange(self._count)[::-1])
        self._faces = np.concatenate([faces, np.zeros((more, *faces.shape[1:]), faces.dtype)])
        shape = (self._count + more, MOST_CANDIDATES, PLACE_COLUMNS)
        padded = np.full(shape, np.nan, np.float32)
        padded[: self._count, : places.shape[-2]] = places
        self._places, self._newest = padded, self._count - 1
