"""The trials whose likelihood a posterior over maps needs, each with its table over gazes."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ja_learning.core.gaze_features import Features, FeaturesOf
from ja_learning.core.gaze_table import SHAPE, gaze_table
from ja_learning.core.replay_memory import ReplayMemory


class SeenTrials(NamedTuple):
    """Trials as the likelihood needs them.

    `features`: of their faces; `tables` (t, *SHAPE) as of `gaze_table`; `counts` (t,): candidates;
    `chance`: the mean table of one candidate, of `SHAPE`.
    """

    features: Features
    tables: NDArray[np.float32]
    counts: NDArray[np.int64]
    chance: NDArray[np.float32]

    def part(self, which: slice) -> 'SeenTrials':
        """Return some of the trials."""
        features = Features(*(each[which] for each in self.features))
        return SeenTrials(features, self.tables[which], self.counts[which], self.chance)


class TrialTables:
    """The tables of the newest trials of a memory, at most `capacity` and as many as it keeps.

    All of it follows from what the memory has and from `trials`, so that no file needs it.
    `trials` counts those that were ever added; each keeps its place, so that sums have the same
    order after a restart.
    """

    def __init__(
        self, memory: ReplayMemory, features_of: FeaturesOf, capacity: int, trials: int
    ) -> None:
        """Make the tables of so many newest trials, the oldest first."""
        self._memory, self._features_of = memory, features_of
        self._capacity = min(capacity, memory.capacity)
        self._tables = np.zeros((0, *SHAPE), np.float32)
        self._counts = np.zeros(0, np.int64)
        self._sum = np.zeros(SHAPE)
        self._newest, self._count = -1, 0
        self._features = features_of(memory.trials_at(np.arange(0))[0])
        known = min(trials, self._capacity, len(memory))
        self.trials = trials - known
        for age in range(known)[::-1]:
            self._add(age)

    def __len__(self) -> int:
        return self._count

    def add_newest(self) -> None:
        """Add the trial that the memory has got last."""
        self._add(0)

    def all(self) -> SeenTrials:
        """Return all of them, in any order."""
        return self._chosen(slice(0, self._count))

    def newest(self) -> SeenTrials:
        """Return the newest alone."""
        return self._chosen(slice(self._newest, self._newest + 1))

    def chance(self) -> NDArray[np.float32]:
        """Return the mean table of one candidate of all trials, of `SHAPE`."""
        return (self._sum / max(self._counts.sum(), 1)).astype(np.float32)

    def seen(self, faces: NDArray[Any], places: NDArray[np.floating]) -> SeenTrials:
        """Return as many trials as faces, in each of which these places (m, 8) were seen."""
        tables = np.broadcast_to(gaze_table(places), (len(faces), *SHAPE))
        counted = np.full(len(faces), len(places))
        return SeenTrials(self._features_of(faces), tables, counted, self.chance())

    def _add(self, age: int) -> None:
        self._newest = self.trials % self._capacity
        while self._newest >= len(self._tables):
            self._grow()
        self.trials += 1
        self._count = min(self._count + 1, self._capacity)
        faces, places = self._memory.trials_at(np.array([age]))
        seen = places[0, ~np.isnan(places[0, :, 0])]
        self._sum -= self._tables[self._newest]
        self._tables[self._newest] = gaze_table(seen)
        self._sum += self._tables[self._newest]
        self._counts[self._newest] = len(seen)
        for kept, new in zip(self._features, self._features_of(faces), strict=True):
            kept[self._newest] = new[0]

    def _chosen(self, which: slice) -> SeenTrials:
        every = SeenTrials(self._features, self._tables, self._counts, self.chance())
        return every.part(which)

    def _grow(self) -> None:
        rows = min(max(64, 2 * len(self._tables)), self._capacity)

        def grown(array: NDArray[Any]) -> NDArray[Any]:
            more = np.zeros((rows, *array.shape[1:]), array.dtype)
            more[: len(array)] = array
            return more

        self._tables, self._counts = grown(self._tables), grown(self._counts)
        self._features = Features(*map(grown, self._features))
