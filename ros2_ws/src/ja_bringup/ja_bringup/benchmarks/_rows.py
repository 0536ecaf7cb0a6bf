"""A figure from samples, with its 95 % interval."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import bootstrap

from ja_bringup.bench import Row


def row(samples: ArrayLike, unit: str, statistic: Callable[..., Any] = np.mean) -> Row:
    """A statistic of samples, shape (n,), and its interval by bootstrap (seeded: repeatable)."""
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
    """The 99th percentile, as a statistic for `row`."""
    return np.percentile(values, 99, axis=axis)
