"""Features of faces that are odd or even in a mirror.

A face is symmetric, and so is the task: in a mirror the gaze's pan changes its sign and its tilt
does not. So pan is linear in features that change their sign, tilt in features that do not.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Features(NamedTuple):
    """Features of n faces: those for the pan (n, k), odd, and those for the tilt (n, l), even."""

    pan: NDArray[np.float64]
    tilt: NDArray[np.float64]


FeaturesOf = Callable[[NDArray[Any]], Features]
"""The features of n faces, as they are read."""
