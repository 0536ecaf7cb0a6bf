"""Fitted values with standard errors, by the jackknife."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class FittedValue:
    """A value and its standard error."""

    value: float
    error: float


def jackknife(
    fit: Callable[[NDArray[np.int_]], NDArray[np.float64]], groups: Sequence[NDArray[np.int_]]
) -> list[FittedValue]:
    """Fit all samples, and estimate the errors by leaving out one group after another.

    `fit` takes the indices of the samples to use. Each group is an array of such indices; groups
    must be independent of each other, even where single samples are not.
    """
    everything = np.concatenate(groups)
    fitted = fit(everything)
    left_out = np.array([fit(np.setdiff1d(everything, group)) for group in groups])
    share = (len(groups) - 1) / len(groups)
    errors = np.sqrt(share * np.sum((left_out - left_out.mean(axis=0)) ** 2, axis=0))
    return [FittedValue(float(v), float(e)) for v, e in zip(fitted, errors, strict=True)]
