"""Shares of successes and means over seeds, each with its 95 % interval.

scipy.stats is imported where it is first needed: it takes half a second, and no node needs it to
start.
"""

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Z_95 = NormalDist().inv_cdf(0.975)


@dataclass(frozen=True)
class Rate:
    """A share of successes among trials, with its 95 % interval (Wilson)."""

    successes: int
    trials: int

    @property
    def rate(self) -> float:
        """Return successes a trial; NaN before the first."""
        return self.successes / self.trials if self.trials else float('nan')

    @property
    def interval(self) -> tuple[float, float]:
        """Return the 95 % confidence interval of the rate; (0, 1) before the first trial."""
        return wilson_interval(self.successes, self.trials)

    def __str__(self) -> str:
        """Return the rate and its interval for people: `0.94 [0.88, 0.97] of 100`."""
        if not self.trials:
            return 'no trials'
        low, high = self.interval
        return f'{self.rate:.2f} [{low:.2f}, {high:.2f}] of {self.trials}'


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """Return the 95 % interval (Wilson, 1927) of a share of successes; (0, 1) without trials.

    Written out, because scipy.stats takes seconds to import on a busy machine, and the processes
    that show this figure supervise nodes meanwhile. A test compares it with scipy's.
    """
    if not trials:
        return (0.0, 1.0)
    share, z2 = successes / trials, _Z_95**2
    centre = share + z2 / (2 * trials)
    reach = _Z_95 * math.sqrt(share * (1 - share) / trials + z2 / (4 * trials**2))
    scale = 1 + z2 / trials
    # Exact at the ends, where rounding would leave the range.
    low = 0.0 if successes == 0 else (centre - reach) / scale
    high = 1.0 if successes == trials else (centre + reach) / scale
    return (low, high)


@dataclass(frozen=True)
class Estimate:
    """A mean and its 95 % interval; `n` is the number of independent runs."""

    mean: float
    low: float
    high: float
    n: int

    def __str__(self) -> str:
        """Return the mean and its interval for a table: `0.944 (0.931-0.957)`."""
        if math.isnan(self.mean):
            return '-'
        return f'{self.mean:.3f} ({self.low:.3f}-{self.high:.3f})'


def over_seeds(shares: ArrayLike) -> Estimate:
    """Return the mean over seeds of a share of successes, (seeds,), with Student's interval.

    The interval is clipped to 0 to 1. Trials of one seed depend on each other through what was
    learned: the seeds are the sample.
    """
    mean, low, high = band_over_seeds(np.asarray(shares, float)[:, None])
    return Estimate(float(mean[0]), float(low[0]), float(high[0]), len(np.asarray(shares)))


def band_over_seeds(
    shares: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return mean, lower and upper end of the 95 % interval over seeds of shares (seeds, n).

    Each is of shape (n,). With a single seed nothing is known of the interval: it is the whole
    range.
    """
    from scipy.stats import t as student

    seeds = len(shares)
    mean = shares.mean(axis=0)
    if seeds < 2:
        return mean, np.zeros_like(mean), np.ones_like(mean)
    half = student.ppf(0.975, seeds - 1) * shares.std(axis=0, ddof=1) / np.sqrt(seeds)
    return mean, np.clip(mean - half, 0.0, 1.0), np.clip(mean + half, 0.0, 1.0)
