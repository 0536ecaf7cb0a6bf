"""A figure from a share of successes in several independent lives."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

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
