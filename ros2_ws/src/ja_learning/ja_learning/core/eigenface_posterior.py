"""The first guess: the posterior over maps from eigenfaces to her gaze.

A network needs many trials before it reads a face. A linear map from a few components of her faces
reads it less well, but its whole posterior is known after each trial (`gaze_posterior`): so it
knows after ten trials roughly where she looks. The networks of the fast learner take its belief as
soft labels, and replace it when their evidence is better.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ja_learning.core.checkpoint_arrays import count
from ja_learning.core.eigenfaces import PRIOR, Eigenfaces
from ja_learning.core.gaze_features import Features
from ja_learning.core.gaze_posterior import GazePosterior, Maps
from ja_learning.core.replay_memory import ReplayMemory
from ja_learning.core.seen_trials import TrialTables

_REMEMBERED = 600
# The components are found again at these numbers of trials: a posterior over other components
# starts anew, which takes as long as all trials so far.
_FIT_AT = (3, 6, 12, 24, 48, 96)
_SWEEPS = 3
_ASKED = 64
_PRIOR, _MOVES, _SAMPLES = range(3)


class EigenfacePosterior:
    """The posterior over linear maps of eigenfaces, for the trials of a memory."""

    def __init__(self, memory: ReplayMemory, seed: int) -> None:
        """Start with the trials that the memory has."""
        self._memory, self._seed = memory, seed
        self._trials = len(memory)
        self._eigenfaces: Eigenfaces | None = None
        self._posterior = GazePosterior(PRIOR, self._random(_PRIOR), _SWEEPS)
        self._tables: TrialTables | None = None
        if self._trials >= _FIT_AT[0]:
            self._fit()

    @property
    def is_known(self) -> bool:
        """Return whether there were enough trials for a guess."""
        return self._tables is not None

    def add_newest(self) -> bool:
        """Learn the trial that the memory got last; return whether the components are new."""
        self._trials += 1
        if self._trials in _FIT_AT:
            self._fit()
            return True
        if self._tables is not None:
            self._tables.add_newest()
            self._posterior.weigh(self._tables.newest())
            self._posterior.move_where_needed(self._tables.all(), self._random(_MOVES))
        return False

    def features(self, faces: NDArray[Any]) -> Features:
        """Return the features of faces, uint8 (n, 30, 25); only once `is_known`."""
        assert self._eigenfaces is not None
        return self._eigenfaces.features(faces)

    def sample(self) -> Maps:
        """Return maps of equal weight, the likeliest in front of them."""
        return self._posterior.sample(self._random(_SAMPLES), _ASKED)

    def log_ratios(
        self, faces: NDArray[np.uint8], places: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """Return log p, (n,), of places (m, 8) given each of the faces, relative to chance."""
        assert self._tables is not None
        return self._posterior.log_ratios(self._tables.seen(faces, places))

    def state(self) -> dict[str, NDArray[Any]]:
        """Return everything that trials have changed, as named arrays."""
        arrays: dict[str, NDArray[Any]] = {'eigenfaces.trials': np.array(self._trials)}
        if self._eigenfaces is not None:
            arrays |= self._eigenfaces.state() | self._posterior.state()
        return arrays

    @classmethod
    def restored(
        cls, arrays: dict[str, NDArray[Any]], memory: ReplayMemory, seed: int
    ) -> 'EigenfacePosterior':
        """Make it from `state()` and the memory that it belongs to; ValueError if it is none."""
        found = cls(ReplayMemory(1), seed)
        found._memory, found._trials = memory, count(arrays, 'eigenfaces.trials')
        if found._trials >= _FIT_AT[0]:
            found._eigenfaces = Eigenfaces.restored(arrays)
            found._posterior.restore(arrays)
            found._tables = TrialTables(memory, found.features, _REMEMBERED)
        return found

    def _fit(self) -> None:
        faces, _ = self._memory.trials_at(np.arange(min(len(self._memory), _REMEMBERED)))
        self._eigenfaces = Eigenfaces(faces)
        self._tables = TrialTables(self._memory, self.features, _REMEMBERED)
        self._posterior = GazePosterior(PRIOR, self._random(_PRIOR), _SWEEPS)
        self._posterior.replay(self._tables.all(), self._random(_MOVES))

    def _random(self, purpose: int) -> np.random.Generator:
        """Return the random numbers of this trial: the same after a restart."""
        return np.random.default_rng([self._seed, self._trials, purpose])
