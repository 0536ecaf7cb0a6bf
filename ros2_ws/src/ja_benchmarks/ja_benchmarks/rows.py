"""Rows of a benchmark's table: a figure from samples, with its 95 % interval."""

from collections.abc import Callable
from typing import Any, TypedDict

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import bootstrap
from scipy.stats import t as student

from ja_common.core.statistics import over_seeds, wilson_interval


class Row(TypedDict):
    """One figure: `n` samples, and the 95 % interval [low, high] of the value, or None."""

    value: float
    unit: str
    n: int
    interval: list[float] | None


def row(samples: ArrayLike, unit: str, statistic: Callable[..., Any] = np.mean) -> Row:
    """Return a statistic of samples (n,) with its interval by bootstrap (seeded: repeatable)."""
    values = np.asarray(samples, float)
    found = bootstrap(
        (values,), statistic, method='percentile', n_resamples=2000, rng=np.random.default_rng(0)
    ).confidence_interval
    return {
        'value': float(statistic(values)),
        'unit': unit,
        'n': len(values),
        'interval': [float(found.low), float(found.high)],
    }


def percentile_99(values: np.ndarray, axis: int = -1) -> Any:
    """Compute the 99th percentile, as a statistic for `row`."""
    return np.percentile(values, 99, axis=axis)


def success_row(shares: ArrayLike) -> Row:
    """Return the mean over seeds of a share of successes (seeds,) with its 95 % interval."""
    estimate = over_seeds(shares)
    return {
        'value': estimate.mean,
        'unit': 'success',
        'n': estimate.n,
        'interval': [estimate.low, estimate.high],
    }


def share_row(hits: ArrayLike, unit: str = 'share') -> Row:
    """Return the share of true values of independent trials (n,) with its 95 % interval."""
    hits = np.asarray(hits)
    interval = wilson_interval(int(hits.sum()), len(hits))
    return {
        'value': float(hits.mean()),
        'unit': unit,
        'n': len(hits),
        'interval': list(interval),
    }


def mean_row(values: ArrayLike, unit: str) -> Row:
    """Return the mean of independent values (n,) with its 95 % interval (Student)."""
    values = np.asarray(values, float)
    mean, error = float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values)))
    half = float(student.ppf(0.975, len(values) - 1)) * error
    return {
        'value': mean,
        'unit': unit,
        'n': len(values),
        'interval': [mean - half, mean + half],
    }
