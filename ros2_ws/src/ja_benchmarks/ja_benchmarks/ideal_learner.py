"""An ideal learner: Bayes' rule over the maps from a reading of her head to its true angles.

It reads her head with a small error, but at first does not know what a reading is: the reading is
an unknown affine map of the head's yaw and pitch, of any sign and scale. Everything else it knows:
the geometry of the scene, how far her gaze misses, which shares her head may take of it. The
attended object is latent, as for every learner. So what it needs in trials is the price of the
question, without that of learning to read a face.

The posterior is a cloud of maps, weighted by each trial in as many steps as the weights need to
stay even (tempering, Neal 2001), resampled and moved by Metropolis steps (resample-move, Gilks and
Berzuini 2001). True maps are drawn from the same prior, for which no learner can be better on
average.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ja_benchmarks.ceiling import draw_arrangements, draw_heads, draw_looked_at, heads_towards
from ja_common.core.geometry import directions_of_vectors
from ja_learning.core.particles import effective_count, resampled
from ja_sim.core.scene import Scene

READING_ERROR_RAD = float(np.radians(0.5))
PARTICLES = 2000

# Likelihoods over the head's yaw and pitch are tabulated up to these angles. Bilinear look-ups
# between the nodes are as good as the narrowest of them, 1.2 degrees, needs.
_YAW_MOST, _PITCH_MOST, _STEP = np.radians([60.0, 36.0, 0.75])
_YAWS = np.arange(-_YAW_MOST, _YAW_MOST + _STEP / 2, _STEP)
_PITCHES = np.arange(-_PITCH_MOST, _PITCH_MOST + _STEP / 2, _STEP)
# Distances and shares that a table averages over; and what stands for a likelihood of zero.
_STEPS, _LEAST = 9, 1e-9
# Moves along the difference of two other particles, as in `ja_learning.core.gaze_posterior`.
_BEST_SHARE, _SHARES, _JITTER = 2.38, (0.1, 0.3, 0.6, 1.0), 0.003
_MOVES, _FEWEST_EFFECTIVE = 8, 0.5


class HeadTrials(NamedTuple):
    """Trials, or test looks, of one arrangement of objects each, the attended one first.

    `heads`: (t, 2) [rad], yaw and pitch as read without knowing the map; `tables`: (t, n, yaws,
    pitches), the likelihood of the true angles for each object.
    """

    heads: NDArray[np.float64]
    tables: NDArray[np.float32]


@dataclass(frozen=True)
class ReadingPrior:
    """What is known of the maps before any trial: deviations of their six numbers.

    A map takes a reading (2,) to `matrix @ reading + offset`. `matrix`: (2, 2); `offset`: (2,)
    [rad]; a deviation of 0 means that the number is 0.
    """

    matrix: tuple[tuple[float, float], tuple[float, float]]
    offset: tuple[float, float]

    @property
    def deviations(self) -> NDArray[np.float64]:
        """Return all of them, (6,): the matrix row by row, then the offset."""
        return np.concatenate([np.ravel(self.matrix), self.offset])


_OFFSET_RAD = float(np.radians(20.0))
ANY_AFFINE = ReadingPrior(((1.0, 1.0), (1.0, 1.0)), (_OFFSET_RAD, _OFFSET_RAD))
MIRRORED_ALIKE = ReadingPrior(((1.0, 0.0), (0.0, 1.0)), (0.0, _OFFSET_RAD))
"""A face is symmetric: in a mirror the yaw changes its sign, and the pitch does not."""


def draw_head_trials(scene: Scene, trials: int, rng: np.random.Generator) -> HeadTrials:
    """Draw so many looks at her in the geometry of the scene."""
    positions = draw_arrangements(scene, trials, rng)
    looked_at = draw_looked_at(scene, positions[:, 0], rng)
    heads = draw_heads(scene, looked_at, rng)
    heads = heads + READING_ERROR_RAD * rng.normal(size=heads.shape)
    tables = [_head_tables(scene, each) for each in directions_of_vectors(positions)]
    return HeadTrials(heads, np.array(tables))


def draw_maps(prior: ReadingPrior, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Draw maps (count, 6) from a prior, each as `ReadingPrior.deviations`."""
    return rng.normal(size=(count, 6)) * prior.deviations


def read_heads(heads: NDArray[np.float64], true_map: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the readings (t, 2) that this map (6,) takes to these angles (t, 2) [rad]."""
    matrix, offset = true_map[:4].reshape(2, 2), true_map[4:]
    return np.asarray(np.linalg.solve(matrix, (heads - offset).T).T, float)


def probabilities(
    maps: NDArray[np.float64], readings: NDArray[np.float64], tables: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Return the probability (t, n) of each object of test looks, by equally probable maps."""
    likelihoods = _look_up(tables, _heads_of(maps, readings)) + _LEAST
    likelihoods *= np.abs(_determinants(maps))[:, None, None]
    mean = likelihoods.mean(axis=0)
    return np.asarray(mean / mean.sum(axis=1, keepdims=True))


class IdealLearner:
    """The posterior over maps, trial by trial."""

    def __init__(
        self, prior: ReadingPrior, rng: np.random.Generator, particles: int = PARTICLES
    ) -> None:
        """Draw the maps from the prior."""
        self._prior, self._rng = prior.deviations, rng
        self._free = self._prior > 0
        self._maps = draw_maps(prior, rng, particles)
        self._log_weights = np.zeros(particles)
        self._readings = np.empty((0, 2))
        self._tables = np.empty((0, 1, len(_YAWS), len(_PITCHES)), np.float32)

    def update(self, reading: NDArray[np.float64], table: NDArray[np.float32]) -> None:
        """Weigh the maps by a reading (2,) and the likelihoods (n, yaws, pitches) of its head."""
        self._readings = np.vstack([self._readings, reading])
        # Which of the objects it was is not known: all are as likely.
        self._tables = np.concatenate([self._tables, table.mean(axis=0)[None, None]])
        done, newest = 0.0, self._log_likelihoods(self._maps)[:, -1]
        while done < 1.0:
            more = _largest_step(self._log_weights, newest, 1.0 - done)
            self._log_weights = self._log_weights + more * newest
            done += more
            if _effective_share(self._log_weights) <= 1.01 * _FEWEST_EFFECTIVE:
                self._resample_and_move(done)
                newest = self._log_likelihoods(self._maps)[:, -1]

    def maps(self, count: int = 1000) -> NDArray[np.float64]:
        """Return so many maps (count, 6) of equal weight."""
        return np.asarray(self._maps[resampled(self._log_weights, self._rng, count)])

    def _resample_and_move(self, newest_power: float) -> None:
        """Resample, and move the maps so that they stay distributed as the tempered posterior."""
        count = len(self._maps)
        maps = self._maps[resampled(self._log_weights, self._rng, count)]
        powers = np.append(np.ones(len(self._readings) - 1), newest_power)

        def log_posterior(proposed: NDArray[np.float64]) -> NDArray[np.float64]:
            scaled = proposed[:, self._free] / self._prior[self._free]
            likelihood: NDArray[np.float64] = self._log_likelihoods(proposed) @ powers
            return likelihood - 0.5 * (scaled**2).sum(axis=1)

        here = log_posterior(maps)
        for move in range(_MOVES):
            proposed = self._flipped(maps) if move % 4 == 0 else self._shifted(maps)
            there = log_posterior(proposed)
            accepted = np.log(self._rng.random(count)) < there - here
            here = np.where(accepted, there, here)
            maps = np.where(accepted[:, None], proposed, maps)
        self._maps, self._log_weights = maps, np.zeros(count)

    def _flipped(self, maps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Propose the yaw to the other side, or the pitch the other way up."""
        yaw = self._rng.random((len(maps), 1)) < 0.5
        signs = np.where(yaw, [-1, -1, 1, 1, -1, 1], [1, 1, -1, -1, 1, -1])
        return np.asarray(signs * maps)

    def _shifted(self, maps: NDArray[np.float64]) -> NDArray[np.float64]:
        count = len(maps)
        one, other = self._rng.permutation(count), self._rng.permutation(count)
        share = _BEST_SHARE / np.sqrt(2 * self._free.sum())
        shares = share * self._rng.choice(_SHARES, size=(count, 1))
        jitter = _JITTER * self._prior * self._rng.normal(size=maps.shape)
        return np.asarray(maps + shares * (maps[one] - maps[other]) + jitter)

    def _log_likelihoods(self, maps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the log likelihood of each trial, (maps, t)."""
        found = _look_up(self._tables, _heads_of(maps, self._readings))[..., 0]
        return np.asarray(np.log(found + _LEAST) + np.log(np.abs(_determinants(maps)))[:, None])


def _head_tables(scene: Scene, directions: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the likelihood (n, yaws, pitches) of the head as read for objects (n, 2) [rad].

    Relative to an even density over all angles of the table.
    """
    area = len(_YAWS) * len(_PITCHES) * _STEP**2
    towards, deviations = zip(*heads_towards(scene, directions, _STEPS), strict=True)
    centres = np.stack(towards, axis=1)[..., None]
    deviation = np.hypot(deviations, READING_ERROR_RAD)[:, None]
    yaws, pitches = (
        np.exp(-0.5 * ((nodes - centres[:, :, axis]) / deviation) ** 2) / deviation
        for axis, nodes in enumerate((_YAWS, _PITCHES))
    )
    together = np.swapaxes(yaws, 1, 2) @ pitches / len(deviations)
    return np.asarray(area / (2 * np.pi) * together, np.float32)


def _heads_of(maps: NDArray[np.float64], readings: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the angles (maps, t, 2) [rad] to which maps take readings (t, 2)."""
    matrices = maps[:, :4].reshape(-1, 2, 2)
    return np.asarray(readings @ np.swapaxes(matrices, 1, 2) + maps[:, None, 4:])


def _determinants(maps: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(maps[:, 0] * maps[:, 3] - maps[:, 1] * maps[:, 2])


def _look_up(tables: NDArray[np.float32], heads: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values (maps, t, n) of tables (t, n, yaws, pitches) at (maps, t, 2) [rad].

    0 beyond the edges.
    """
    at = (heads + np.array([_YAW_MOST, _PITCH_MOST])) / _STEP
    inside = ((at >= 0) & (at < [len(_YAWS) - 1, len(_PITCHES) - 1])).all(axis=-1)
    at = np.where(inside[..., None], at, 0.0)
    i, j = np.moveaxis(at.astype(int), -1, 0)
    x, y = (at - np.stack([i, j], axis=-1))[..., None].transpose(2, 0, 1, 3)
    t = np.arange(len(tables))
    near = (1 - x) * ((1 - y) * tables[t, :, i, j] + y * tables[t, :, i, j + 1])
    far = x * ((1 - y) * tables[t, :, i + 1, j] + y * tables[t, :, i + 1, j + 1])
    return np.where(inside[..., None], near + far, 0.0)


def _largest_step(
    log_weights: NDArray[np.float64], newest: NDArray[np.float64], most: float
) -> float:
    """Return the largest power of the newest likelihood that leaves enough effective maps."""
    if _effective_share(log_weights + most * newest) >= _FEWEST_EFFECTIVE:
        return most
    low, high = 0.0, most
    for _ in range(20):
        middle = 0.5 * (low + high)
        enough = _effective_share(log_weights + middle * newest) >= _FEWEST_EFFECTIVE
        low, high = (middle, high) if enough else (low, middle)
    return high


def _effective_share(log_weights: NDArray[np.float64]) -> float:
    """Return what share of maps of equal weight would be worth as much."""
    return effective_count(log_weights) / len(log_weights)
