"""The trials that a learner of contrasts remembers: faces relative to what is usual for her now.

After the first looks her mean face is hardly known. So pictures are remembered as they were, and
read as contrasts to the newest mean face of the same person.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ja_learning.core.checkpoint_arrays import counts, numbers
from ja_learning.core.mean_face import contrasts
from ja_learning.core.replay_memory import ReplayMemory
from ja_learning.core.trial import FACE_SHAPE, FaceFormat, MeanFace, Trial

CONTRAST = FaceFormat(FACE_SHAPE, np.float32)
_UNKNOWN = MeanFace(0, np.zeros(FACE_SHAPE, np.float32))
_MOST_CONTRAST = 1000.0


class ContrastMemory(ReplayMemory):
    """A ring of pictures and places, whose faces are read as contrasts, float32 (..., 30, 25)."""

    def __init__(self, capacity: int) -> None:
        """Start empty."""
        super().__init__(capacity)
        # Of each person who is remembered, the newest last: number and mean face; and of each
        # trial, the oldest first, the index of its person.
        self._persons: list[MeanFace] = []
        self._person_of = np.zeros(0, np.int64)

    @property
    def mean_face(self) -> MeanFace | None:
        """Return the mean face of the person of the newest trial."""
        return self._persons[-1] if self._persons else None

    @property
    def of_present_person(self) -> int:
        """Return how many trials are of the person of the newest one, all in a row."""
        others = np.flatnonzero(self._person_of != len(self._persons) - 1)
        return len(self) - (int(others[-1]) + 1 if len(others) else 0)

    def remember(self, trial: Trial, places: NDArray[np.floating]) -> None:
        """Remember a trial's face and the places (m, 8) seen with it, and her mean face."""
        mean_face = trial.mean_face or _UNKNOWN
        if self._persons and self._persons[-1].person == mean_face.person:
            self._persons[-1] = mean_face
        else:
            self._persons.append(mean_face)
        self.remember_trial(trial.face, places)
        newest = np.append(self._person_of, len(self._persons) - 1)
        self._keep_persons(newest[-len(self) :])

    def keep_newest(self, count: int) -> None:
        """Forget all but so many, and who is in none of them."""
        super().keep_newest(count)
        self._keep_persons(self._person_of[len(self._person_of) - len(self) :])

    def state(self) -> dict[str, NDArray[Any]]:
        """Return all that is remembered, oldest first, as named arrays."""
        pictures = np.array([each.picture for each in self._persons], np.float32)
        return super().state() | {
            'mean_faces': pictures.reshape(-1, *FACE_SHAPE),
            'persons': np.array([each.person for each in self._persons], np.int64),
            'person_of_trials': self._person_of.copy(),
        }

    @classmethod
    def restored(
        cls, arrays: dict[str, NDArray[Any]], capacity: int, faces: FaceFormat | None = None
    ) -> 'ContrastMemory':
        """Make a memory from `state()`; ValueError if it is none."""
        if faces is not None:
            raise ValueError('a memory of contrasts keeps pictures and nothing else')
        persons = counts(arrays, 'persons')
        limit = _MOST_CONTRAST
        pictures = numbers(
            arrays, 'mean_faces', (len(persons), *FACE_SHAPE), low=-limit, high=limit
        )
        memory = cls(capacity)
        memory._take(arrays)
        person_of = counts(arrays, 'person_of_trials', (len(memory),))
        if len(memory) and (not len(persons) or person_of.max() >= len(persons)):
            raise ValueError(f'person_of_trials must be below {len(persons)}')
        memory._persons = [
            MeanFace(int(n), each) for n, each in zip(persons, pictures, strict=True)
        ]
        memory._person_of = person_of
        return memory

    def _read(self, faces: NDArray[Any], ages: NDArray[np.int64]) -> NDArray[Any]:
        if not len(self):
            return faces.astype(np.float32)
        pictures = np.array([each.picture for each in self._persons])
        return contrasts(faces, pictures[self._person_of[-1 - ages]])

    def _keep_persons(self, person_of: NDArray[np.int64]) -> None:
        # The newest person stays, whose mean face is still wanted.
        kept = sorted({*person_of.tolist(), *range(len(self._persons))[-1:]})
        self._persons = [self._persons[each] for each in kept]
        self._person_of = np.searchsorted(kept, person_of)
