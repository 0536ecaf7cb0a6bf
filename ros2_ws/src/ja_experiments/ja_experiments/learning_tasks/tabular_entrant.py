"""A learner without a network: counts of where objects stood, by a coarse code of her face.

Her face is divided into blocks. A block that is brighter than it usually is gives a one, so six
blocks give 64 codes. For each code the table counts the cells of directions in which objects were
seen. Over many trials the attended object is the only one that stands more often in one cell with
one code than with all others (cross-situational learning).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ja_experiments.learning_tasks.drawn_trials import Observation, towards

_BLOCKS = (2, 3)
_CELL_RAD = np.radians([12.0, 10.0])
_CELLS = (9, 5)
_CODES = 2 ** (_BLOCKS[0] * _BLOCKS[1])
_PRIOR_COUNT = 2.0


class TabularEntrant:
    """Turns to the object whose cell was filled more often with this code than with others."""

    track = 'strict'

    def __init__(self, seed: int) -> None:
        """Begin with an empty table; the seed makes no difference."""
        self._counts = np.zeros((_CODES, *_CELLS))
        self._brightness = np.zeros(_BLOCKS)
        self._trials = 0

    def propose(self, observation: Observation) -> NDArray:
        """Return the turn to the object with the highest ratio of counts."""
        pan, tilt = self._cells(observation)
        cells = self._counts[:, pan, tilt]
        everywhere = (cells.sum(axis=0) + _PRIOR_COUNT) / (self._counts.sum() + _PRIOR_COUNT)
        code = self._code(observation)
        expected = everywhere * self._counts[code].sum()
        ratios = (cells[code] + _PRIOR_COUNT) / (expected + _PRIOR_COUNT)
        return towards(observation, int(np.argmax(ratios)))

    def learn(self, observation: Observation, fixated: int) -> None:
        """Count the cells of all objects; which of them was fixated makes no difference."""
        self._trials += 1
        self._brightness += (_blocks(observation['face']) - self._brightness) / self._trials
        pan, tilt = self._cells(observation)
        np.add.at(self._counts, (self._code(observation), pan, tilt), 1.0)

    def _code(self, observation: Observation) -> int:
        bits = (_blocks(observation['face']) > self._brightness).ravel()
        return int(bits @ 2 ** np.arange(bits.size))

    @staticmethod
    def _cells(observation: Observation) -> NDArray[np.intp]:
        """Return the cells (2, n) of the objects, relative to her face."""
        away = (observation['objects'] - observation['face_direction']) / _CELL_RAD
        half = np.array(_CELLS) // 2
        return (np.rint(away).clip(-half, half) + half).astype(int).T


def _blocks(face: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the mean brightness of each block, relative to the whole face."""
    rows = np.array_split(face.astype(float), _BLOCKS[0])
    means = [[part.mean() for part in np.array_split(row, _BLOCKS[1], axis=1)] for row in rows]
    return np.array(means) - np.mean(means)
