"""The posterior over maps from a face to her gaze, by particles.

Where a face is described by a few features, the map to her gaze has few parameters; and a trial is
a look-up for any of them (`gaze_table`). That is few enough for Bayes' rule itself: a cloud of
maps, drawn from a broad prior, is weighted by every trial, resampled where few maps carry the
weight, and moved by Metropolis steps that keep the posterior (resample-move, Gilks and Berzuini
2001). There is no step size and no annealing. As long as two maps explain the trials alike - the
mirrored gaze is the classical one - both stay.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ja_learning.core.checkpoint_arrays import counts, numbers
from ja_learning.core.compiled import compiled
from ja_learning.core.gaze_features import Features
from ja_learning.core.gaze_table import LEVELS, look_up, look_up_place
from ja_learning.core.particles import effective_count, resampled
from ja_learning.core.seen_trials import SeenTrials

PARTICLES = 400
NONE_WAS_MEANT = (0.02, 0.05, 0.15, 0.35)
"""How probable it may be that no candidate is the attended object."""

_MOVED_BELOW = 0.5
# Moves along the difference of two other particles (differential evolution, ter Braak 2006) need
# no tuning: 2.38 / sqrt(2 d) of it is best for a normal posterior, less helps where it is not.
_BEST_SHARE = 2.38
_SHARES = (0.3, 0.6, 1.0)
_JITTER = 0.005


class Maps(NamedTuple):
    """A cloud of maps, their gaze linear in the features of a face.

    `pan` (p, k) and `tilt` (p, l): weights of the features. `levels` (p,): into `LEVELS`. `none`
    (p,): the probability that no candidate is the attended object.
    """

    pan: NDArray[np.float64]
    tilt: NDArray[np.float64]
    levels: NDArray[np.int64]
    none: NDArray[np.float64]

    def chosen(self, index: NDArray[np.integer]) -> 'Maps':
        """Return these of the maps."""
        return Maps(*(each[index] for each in self))

    def gazes(self, features: Features) -> NDArray[np.float64]:
        """Return u, (p, n, 2), of n faces."""
        return np.stack([self.pan @ features.pan.T, self.tilt @ features.tilt.T], axis=-1)


class GazePosterior:
    """A weighted cloud of maps.

    `prior`: deviations (k,), (l,) of the weights before any trial. `sweeps`: how often all kinds
    of moves are made when the maps are moved; more where features are many.
    """

    def __init__(self, prior: Features, random: np.random.Generator, sweeps: int = 1) -> None:
        """Draw the maps from the prior: any direction and size of gaze."""
        self._prior, self._sweeps = prior, sweeps
        self._maps = self._drawn(random, PARTICLES)
        self._log_weights = np.zeros(PARTICLES)

    def weigh(self, newest: SeenTrials) -> None:
        """Weigh the maps by trials that they were not weighed by."""
        self._log_weights = self._log_weights + _log_likelihood(self._maps, newest)

    def move_where_needed(self, trials: SeenTrials, random: np.random.Generator) -> None:
        """Resample and move the maps if few of them carry the weight; `trials`: all so far."""
        if effective_count(self._log_weights) >= _MOVED_BELOW * PARTICLES:
            return
        maps = self._maps.chosen(resampled(self._log_weights, random, PARTICLES))
        self._maps = self._moved(maps, trials, random)
        self._log_weights = np.zeros(PARTICLES)

    def replay(self, trials: SeenTrials, random: np.random.Generator) -> None:
        """Weigh and move by these trials, one after the other."""
        for index in range(len(trials.counts)):
            self.weigh(trials.part(slice(index, index + 1)))
            self.move_where_needed(trials.part(slice(0, index + 1)), random)

    def doubt_half(self, trials: SeenTrials, random: np.random.Generator) -> None:
        """Draw half of the maps anew, and weigh all by these trials only: the world changed."""
        kept = self._maps.chosen(resampled(self._log_weights, random, PARTICLES // 2))
        fresh = self._drawn(random, PARTICLES - PARTICLES // 2)
        both = (np.concatenate(pair) for pair in zip(kept, fresh, strict=True))
        self._maps, self._log_weights = Maps(*both), np.zeros(PARTICLES)
        self.replay(trials, random)

    def log_ratios(self, trials: SeenTrials) -> NDArray[np.float64]:
        """Return log p of what was seen in each of the trials, relative to chance, (t,)."""
        each = _log_ratios(*_arguments(self._maps, trials)) + self._log_weights[:, None]
        total: NDArray[np.float64] = np.logaddexp.reduce(each, axis=0)
        return total - np.logaddexp.reduce(self._log_weights)

    def log_ratios_of_places(
        self, face: Features, places: NDArray[np.floating], chance: NDArray[np.float32]
    ) -> NDArray[np.float64]:
        """Return log p, (m,), of each of places (m, 8) alone, relative to chance.

        `face`: the features of the one face with which they were seen; `chance`: as in
        `SeenTrials`.
        """
        maps, seen = self._maps, np.ascontiguousarray(places, np.float64)
        each = _log_ratios_of_places(maps.gazes(face)[:, 0], maps.levels, maps.none, seen, chance)
        total: NDArray[np.float64] = np.logaddexp.reduce(each + self._log_weights[:, None], axis=0)
        return total - np.logaddexp.reduce(self._log_weights)

    def sample(self, random: np.random.Generator, count: int) -> Maps:
        """Return so many maps of equal weight, the likeliest in front of them."""
        chosen = resampled(self._log_weights, random, count)
        return self._maps.chosen(np.append(np.argmax(self._log_weights), chosen))

    def state(self) -> dict[str, NDArray[Any]]:
        """Return everything that trials have changed, as named arrays."""
        arrays = {f'maps.{name}': each.copy() for name, each in self._maps._asdict().items()}
        return {**arrays, 'maps.log_weights': self._log_weights.copy()}

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Take the state of `state()`; ValueError, and no change, if it is none of this prior."""
        levels = counts(arrays, 'maps.levels', (PARTICLES,))
        if (levels >= len(LEVELS)).any():
            raise ValueError(f'maps.levels must be below {len(LEVELS)}')
        maps = Maps(
            numbers(arrays, 'maps.pan', self._maps.pan.shape, np.float64),
            numbers(arrays, 'maps.tilt', self._maps.tilt.shape, np.float64),
            levels,
            numbers(arrays, 'maps.none', (PARTICLES,), np.float64, low=0.001, high=0.999),
        )
        log_weights = numbers(arrays, 'maps.log_weights', (PARTICLES,), np.float64)
        self._maps, self._log_weights = maps, log_weights

    def _drawn(self, random: np.random.Generator, count: int) -> Maps:
        pan, tilt = (random.normal(size=(count, len(each))) * each for each in self._prior)
        levels = random.integers(len(LEVELS), size=count)
        return Maps(pan, tilt, levels, random.choice(NONE_WAS_MEANT, size=count))

    def _moved(self, maps: Maps, trials: SeenTrials, random: np.random.Generator) -> Maps:
        """Move maps that are distributed as the posterior, so that they stay so."""
        here = self._log_posterior(maps, trials)
        for propose in self._sweeps * _PROPOSALS:
            proposed = propose(maps, random)
            there = self._log_posterior(proposed, trials)
            accepted = np.log(random.random(len(here))) < there - here
            here = np.where(accepted, there, here)
            maps = Maps(
                *(
                    np.where(accepted.reshape(-1, *[1] * (old.ndim - 1)), new, old)
                    for new, old in zip(proposed, maps, strict=True)
                )
            )
        return maps

    def _log_posterior(self, maps: Maps, trials: SeenTrials) -> NDArray[np.float64]:
        squares = ((maps.pan / self._prior.pan) ** 2).sum(axis=1)
        squares += ((maps.tilt / self._prior.tilt) ** 2).sum(axis=1)
        return _log_likelihood(maps, trials) - 0.5 * squares


def _log_likelihood(maps: Maps, trials: SeenTrials) -> NDArray[np.float64]:
    total: NDArray[np.float64] = _log_ratios(*_arguments(maps, trials)).sum(axis=1)
    return total


def _arguments(maps: Maps, trials: SeenTrials) -> tuple[NDArray[Any], ...]:
    gazes = maps.gazes(trials.features)
    return gazes, maps.levels, maps.none, trials.tables, trials.counts, trials.chance


@compiled
def _log_ratios(gazes, levels, none, tables, counts, chance):  # type: ignore[no-untyped-def]
    found = np.empty((len(levels), len(tables)))
    for p in range(len(levels)):
        for t in range(len(tables)):
            pan, tilt = gazes[p, t, 0], gazes[p, t, 1]
            by_chance = counts[t] * look_up(chance, levels[p], pan, tilt)
            ratio = look_up(tables[t], levels[p], pan, tilt) / max(by_chance, 1e-12)
            found[p, t] = math.log((1 - none[p]) * ratio + none[p])
    return found


@compiled
def _log_ratios_of_places(gazes, levels, none, places, chance):  # type: ignore[no-untyped-def]
    found = np.empty((len(levels), len(places)))
    for p in range(len(levels)):
        pan, tilt = gazes[p]
        by_chance = max(look_up(chance, levels[p], pan, tilt), 1e-12)
        for m in range(len(places)):
            ratio = look_up_place(places[m], levels[p], pan, tilt) / by_chance
            found[p, m] = math.log((1 - none[p]) * ratio + none[p])
    return found


def _mirrored(maps: Maps, random: np.random.Generator) -> Maps:
    """Propose the gaze to the other side, or the other way up."""
    pan = random.random((len(maps.levels), 1)) < 0.5
    return maps._replace(
        pan=np.where(pan, -maps.pan, maps.pan), tilt=np.where(pan, maps.tilt, -maps.tilt)
    )


def _shifted(maps: Maps, random: np.random.Generator) -> Maps:
    count = len(maps.levels)
    one, other = random.permutation(count), random.permutation(count)
    share = _BEST_SHARE / math.sqrt(2 * (maps.pan.shape[1] + maps.tilt.shape[1]))
    shares = share * random.choice(_SHARES, size=(count, 1))

    def shifted(weights: NDArray[np.float64]) -> NDArray[np.float64]:
        jitter = _JITTER * random.normal(size=weights.shape)
        return weights + shares * (weights[one] - weights[other]) + jitter

    return maps._replace(pan=shifted(maps.pan), tilt=shifted(maps.tilt))


def _with_other_levels(maps: Maps, random: np.random.Generator) -> Maps:
    return maps._replace(levels=random.integers(len(LEVELS), size=len(maps.levels)))


def _with_other_none(maps: Maps, random: np.random.Generator) -> Maps:
    return maps._replace(none=random.choice(NONE_WAS_MEANT, size=len(maps.none)))


_PROPOSALS = (_mirrored, _shifted, _with_other_levels, _shifted, _with_other_none, _shifted)
