"""Principal components of her faces: few numbers a face, learned without any label.

Eigenfaces (Turk and Pentland 1991), apart for what is odd and what is even in a mirror: the pan of
her gaze depends on the odd ones, its tilt on the even ones.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ja_learning.core.checkpoint_arrays import numbers
from ja_learning.core.gaze_features import Features
from ja_learning.core.trial import FACE_SHAPE

COMPONENTS = 6
PRIOR = Features(
    np.append(np.full(COMPONENTS, 0.7), 0.3), np.append(np.full(COMPONENTS, 0.35), 0.2)
)
"""Deviations of the weights of the features before any trial.

A feature is as large as the share of its component in the variance, so that most of the gaze is
expected in the first ones. The last feature of both, 1, has the gaze of the mean face: over few
looks her gazes do not cancel out.
"""

_PIXELS = FACE_SHAPE[0] * FACE_SHAPE[1]


class Eigenfaces:
    """The components of some faces; features of any others follow from them."""

    def __init__(self, faces: NDArray[np.floating]) -> None:
        """Find the components of faces, as contrasts (n, 30, 25) (`mean_face`)."""
        odd, even = _parts(faces)
        self._mean = even.mean(axis=0)
        self._odd, self._even = _components(odd), _components(even - self._mean)

    def features(self, faces: NDArray[np.floating]) -> Features:
        """Return the features of faces, as contrasts (n, 30, 25): (n, 7) for pan and for tilt."""
        odd, even = _parts(faces)
        one = np.ones((len(odd), 1))
        pan, tilt = odd @ self._odd.T, (even - self._mean) @ self._even.T
        return Features(np.append(pan, one, axis=1), np.append(tilt, one, axis=1))

    def state(self) -> dict[str, NDArray[Any]]:
        """Return the components as named arrays."""
        return {
            'eigenfaces.mean': self._mean.copy(),
            'eigenfaces.odd': self._odd.copy(),
            'eigenfaces.even': self._even.copy(),
        }

    @classmethod
    def restored(cls, arrays: dict[str, NDArray[Any]]) -> 'Eigenfaces':
        """Make them from `state()`; ValueError if it is none."""
        found = cls.__new__(cls)
        found._mean = numbers(arrays, 'eigenfaces.mean', (_PIXELS,), np.float64)
        found._odd = numbers(arrays, 'eigenfaces.odd', (COMPONENTS, _PIXELS), np.float64)
        found._even = numbers(arrays, 'eigenfaces.even', (COMPONENTS, _PIXELS), np.float64)
        return found


def _parts(faces: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the odd and the even part of each face, each (n, 750)."""
    contrasts = np.asarray(faces, float).reshape(-1, *FACE_SHAPE)
    mirrored = contrasts[:, :, ::-1]
    flat = (len(contrasts), _PIXELS)
    return ((contrasts - mirrored) / 2).reshape(flat), ((contrasts + mirrored) / 2).reshape(flat)


def _components(parts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the first components (6, 750), so that the first feature has the deviation 1."""
    _, sizes, axes = np.linalg.svd(parts, full_matrices=False)
    found = np.zeros((COMPONENTS, _PIXELS))
    count = min(COMPONENTS, len(axes))
    found[:count] = axes[:count] * np.sqrt(len(parts)) / max(float(sizes[0]), 1e-9)
    return found
