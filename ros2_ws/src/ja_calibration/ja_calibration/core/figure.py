"""A number that was found, and how far it may be off."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Figure:
    """A value and its standard error."""

    value: float
    error: float


def jackknife(
    fit: Callable[[NDArray[np.int_]], NDArray[np.float64]], groups: Sequence[NDArray[np.int_]]
) -> list[Figure]:
    """What a fit of samples finds, and its errors: those of leaving out one group after another.

    `fit` is given the indices of the samples it may use; groups are such indices, and independent
    of each other where samples are not.
    """
    everything = np.concatenate(groups)
    found = fit(everything)
    left_out = np.array([fit(np.setdiff1d(everything, group)) for group in groups])
    share = (len(groups) - 1) / len(groups)
    errors = np.sqrt(share * np.sum((left_out - left_out.mean(axis=0)) ** 2, axis=0))
    return [Figure(float(v), float(e)) for v, e in zip(found, errors, strict=True)]
