"""The first guess: the posterior over maps from eigenfaces to her gaze.

A network needs many trials before it reads a face. A linear map from a few components of her faces
reads it less well, but its whole posterior is known after each trial (`gaze_posterior`): so it
knows after ten trials roughly where she looks. The networks of the fast learner take its belief as
soft labels, and replace it when their evidence is better.

In place of the components, features may come from a network that was trained beforehand
(`face_code`).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ja_learning.core.checkpoint_arrays import count, numbers
from ja_learning.core.eigenfaces import PRIOR, Eigenfaces
from ja_learning.core.face_code import PRIOR as PRIOR_OF_CODE
from ja_learning.core.face_code import FaceCode
from ja_learning.core.gaze_features import Features
from ja_learning.core.gaze_posterior import GazePosterior, Maps
from ja_learning.core.replay_memory import ReplayMemory
from ja_learning.core.seen_trials import TrialTables

_REMEMBERED = 600
# The components are found again at these numbers of trials, with a better mean face: a posterior
# over other features starts anew, which takes as long as all trials so far.
_FIT_AT = (3, 6, 12, 24, 48, 96)
GUESS_BEGINS = len(_FIT_AT)
"""So often the guess restarts with a person."""
_SWEEPS = 3
_ASKED = 64
_PRIOR, _MOVES, _SAMPLES = range(3)


class EigenfacePosterior:
    """The posterior over linear maps of eigenfaces, for the newest trials of a memory.

    `trials`: how many of them it is for.
    """

    def __init__(
        self, memory: ReplayMemory, seed: int, trials: int, code: FaceCode | None = None
    ) -> None:
        """Start with so many newest trials of the memory; `code`: read faces with it instead."""
        self._memory, self._seed = memory, seed
        self.trials = trials
        self._code = code
        self._eigenfaces: Eigenfaces | None = None
        self._posterior = self._drawn_posterior()
        self._tables: TrialTables | None = None
        if self.trials >= _FIT_AT[0]:
            self._fit()

    @property
    def is_known(self) -> bool:
        """Return whether there were enough trials for a guess."""
        return self._tables is not None

    def add_newest(self) -> bool:
        """Learn the trial that the memory got last; return whether the components are new."""
        self.trials += 1
        if self.trials in _FIT_AT:
            self._fit()
            return True
        if self._tables is not None:
            self._tables.add_newest()
            self._posterior.weigh(self._tables.newest())
            self._posterior.move_where_needed(self._tables.all(), self._random(_MOVES))
        return False

    def features(self, faces: NDArray[Any]) -> Features:
        """Return the features of faces, as contrasts (n, 30, 25); only once `is_known`."""
        if self._code is not None:
            return self._code.features(faces)
        assert self._eigenfaces is not None
        return self._eigenfaces.features(faces)

    def sample(self) -> Maps:
        """Return maps of equal weight, the likeliest in front of them."""
        return self._posterior.sample(self._random(_SAMPLES), _ASKED)

    def log_ratios(
        self, faces: NDArray[np.float32], places: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """Return log p, (n,), of places (m, 8) given each of the faces, relative to chance."""
        assert self._tables is not None
        return self._posterior.log_ratios(self._tables.seen(faces, places))

    def log_ratios_of_places(
        self, face: NDArray[np.float32], places: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """Return log p, (m,), of each of places (m, 8) alone given a face, relative to chance."""
        assert self._tables is not None
        chance = self._tables.chance()
        return self._posterior.log_ratios_of_places(self.features(face[None]), places, chance)

    def state(self) -> dict[str, NDArray[Any]]:
        """Return everything that trials have changed, as named arrays."""
        arrays: dict[str, NDArray[Any]] = {'eigenfaces.trials': np.array(self.trials)}
        if self._eigenfaces is not None:
            arrays |= self._eigenfaces.state()
        if self._code is not None:
            arrays['face_code.sha256'] = _digest(self._code)
        if self.is_known:
            arrays |= self._posterior.state()
        return arrays

    @classmethod
    def restored(
        cls,
        arrays: dict[str, NDArray[Any]],
        memory: ReplayMemory,
        seed: int,
        code: FaceCode | None = None,
    ) -> 'EigenfacePosterior':
        """Make it from `state()` and the memory that it belongs to.

        Raises ValueError if it is none, or one of another code.
        """
        found = cls(ReplayMemory(1), seed, 0, code)
        if code is not None:
            digest = numbers(arrays, 'face_code.sha256', (32,), np.uint8)
            if not np.array_equal(digest, _digest(code)):
                raise ValueError(f'it learned with the face code {bytes(digest).hex()[:16]}')
        found._memory, found.trials = memory, count(arrays, 'eigenfaces.trials')
        if found.trials >= _FIT_AT[0]:
            if code is None:
                found._eigenfaces = Eigenfaces.restored(arrays)
            found._posterior.restore(arrays)
            found._tables = TrialTables(memory, found.features, _REMEMBERED, found.trials)
        return found

    def _fit(self) -> None:
        faces, _ = self._memory.trials_at(
            np.arange(min(self.trials, len(self._memory), _REMEMBERED))
        )
        if self._code is None:
            self._eigenfaces = Eigenfaces(faces)
        self._tables = TrialTables(self._memory, self.features, _REMEMBERED, self.trials)
        self._posterior = self._drawn_posterior()
        self._posterior.replay(self._tables.all(), self._random(_MOVES))

    def _drawn_posterior(self) -> GazePosterior:
        prior = PRIOR if self._code is None else PRIOR_OF_CODE
        return GazePosterior(prior, self._random(_PRIOR), _SWEEPS)

    def _random(self, purpose: int) -> np.random.Generator:
        """Return the random numbers of this trial: the same after a restart."""
        return np.random.default_rng([self._seed, self.trials, purpose])


def _digest(code: FaceCode) -> NDArray[np.uint8]:
    """Return the SHA-256 (32,) of the file of a code; zeros before it has one."""
    return np.frombuffer(bytes.fromhex(code.sha256 or 64 * '0'), np.uint8).copy()
