"""Checks of the arrays of a checkpoint: a learner takes only what it could have written itself."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

LARGEST = 1e6
"""No weight, moment or evidence of a learner that works comes near; larger ones overflow later."""

_MOST_COUNTED = 2**53


def numbers(
    arrays: Mapping[str, NDArray[Any]],
    name: str,
    shape: tuple[int, ...],
    dtype: type[np.generic] = np.float32,
    low: float = -LARGEST,
    high: float = LARGEST,
) -> NDArray[Any]:
    """Return a copy of an array of this shape and type, all numbers from `low` to `high`.

    Raises ValueError with one sentence.
    """
    array = _named(arrays, name)
    if array.shape != shape or array.dtype != dtype:
        raise ValueError(
            f'{name} must be {np.dtype(dtype)} of shape {shape}, found {array.dtype} of shape '
            f'{array.shape}'
        )
    if not ((low <= array) & (array <= high)).all():  # false for NaN, too
        raise ValueError(f'{name} must hold numbers from {low:g} to {high:g}')
    return array.copy()


def count(arrays: Mapping[str, NDArray[Any]], name: str) -> int:
    """Return a count. Raises ValueError with one sentence."""
    return int(counts(arrays, name, ()))


def counts(
    arrays: Mapping[str, NDArray[Any]], name: str, shape: tuple[int, ...] | None = None
) -> NDArray[np.int64]:
    """Return counts of this shape; None: a row of any length. Raises ValueError."""
    array = _named(arrays, name)
    fits = array.ndim == 1 if shape is None else array.shape == shape
    if not fits or array.dtype.kind not in 'iu':
        raise ValueError(f'{name} must be counts, found {array.dtype} of shape {array.shape}')
    if not ((array >= 0) & (array <= _MOST_COUNTED)).all():
        raise ValueError(f'{name} must be counts from 0 to {_MOST_COUNTED}')
    return array.astype(np.int64)


def _named(arrays: Mapping[str, NDArray[Any]], name: str) -> NDArray[Any]:
    if name not in arrays:
        raise ValueError(f'{name} is missing')
    return arrays[name]
