"""Weighted particles: how many of them count, and drawing as many of equal weight."""

import numpy as np
from numpy.typing import NDArray


def effective_count(log_weights: NDArray[np.float64]) -> float:
    """Return how many particles of equal weight would be worth as much (Kong 1992)."""
    weights = np.exp(log_weights - log_weights.max())
    return float(weights.sum() ** 2 / (weights**2).sum())


def resampled(
    log_weights: NDArray[np.float64], random: np.random.Generator, count: int
) -> NDArray[np.integer]:
    """Return so many indices, each as often as its weight demands (systematic resampling)."""
    weights = np.exp(log_weights - log_weights.max())
    places = (random.random() + np.arange(count)) / count
    found = np.searchsorted(np.cumsum(weights / weights.sum()), places)
    return np.minimum(found, len(log_weights) - 1)
