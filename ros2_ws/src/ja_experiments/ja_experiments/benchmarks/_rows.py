"""Figures, each with its 95 % interval: of independent trials, or of several independent lives."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import binomtest

from ja_experiments.estimate import over_seeds


def success_row(shares: ArrayLike) -> dict[str, Any]:
    """Mean over seeds of a share of successes, (seeds,), and its 95 % interval."""
    estimate = over_seeds(shares)
    return {
        'value': estimate.mean,
        'unit': 'success',
        'n': estimate.n,
        'interval': [estimate.low, estimate.high],
    }


def share_row(hits: ArrayLike, unit: str = 'share') -> dict[str, Any]:
    """Share of independent trials that succeeded, of bools (n,), and its 95 % interval."""
    hits = np.asarray(hits)
    result = binomtest(int(hits.sum()), len(hits)).proportion_ci(method='wilson')
    return {
        'value': float(hits.mean()),
        'unit': unit,
        'n': len(hits),
        'interval': [float(result.low), float(result.high)],
    }


def mean_row(values: ArrayLike, unit: str) -> dict[str, Any]:
    """Mean of independent values (n,), and its 95 % interval."""
    values = np.asarray(values, float)
    mean, error = float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values)))
    interval = [mean - 1.96 * error, mean + 1.96 * error]
    return {'value': mean, 'unit': unit, 'n': len(values), 'interval': interval}
