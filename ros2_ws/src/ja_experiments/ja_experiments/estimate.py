"""Means over seeds and shares of trials, each with its 95 % interval."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import t as student


@dataclass(frozen=True)
class Estimate:
    """A mean and its 95 % interval; `n` is the number of independent runs."""

    mean: float
    low: float
    high: float
    n: int

    def __str__(self) -> str:
        if math.isnan(self.mean):
            return '-'
        return f'{self.mean:.3f} ({self.low:.3f}-{self.high:.3f})'


def over_seeds(shares: ArrayLike) -> Estimate:
    """Mean over seeds of a share of successes, (seeds,), with Student's interval inside 0 to 1.

    Trials of one seed depend on each other through what was learned: the seeds are the sample.
    """
    mean, low, high = band_over_seeds(np.asarray(shares, float)[:, None])
    return Estimate(float(mean[0]), float(low[0]), float(high[0]), len(np.asarray(shares)))


def band_over_seeds(
    shares: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Mean, lower and upper end of the 95 % interval over seeds, each (n,), of shares (seeds, n).

    With a single seed nothing is known of the interval: it is the whole range.
    """
    seeds = len(shares)
    mean = shares.mean(axis=0)
    if seeds < 2:
        return mean, np.zeros_like(mean), np.ones_like(mean)
    half = student.ppf(0.975, seeds - 1) * shares.std(axis=0, ddof=1) / np.sqrt(seeds)
    return mean, np.clip(mean - half, 0.0, 1.0), np.clip(mean + half, 0.0, 1.0)
