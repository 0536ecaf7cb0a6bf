"""The mean face of the person before the head: what a look shows is how it differs from that.

A picture of a face shows who she is and in which light far more than where she looks. Her mean
face over many looks, her gaze now here, now there, is the same person in the same light at about
zero gaze. The contrast to it is what has changed. It carries over to another person, whose mean
face is known after a few looks. No label is used, and no trial needs to end.
"""

import zlib
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ja_learning.core.trial import FACE_SHAPE, Look, MeanFace

LEAST_VARIANCE = 0.06
"""Added to the variance of a picture, of the pixels 0-255: a flat picture is not enlarged."""

CONTRAST_SCALE = 2.0
"""A contrast is enlarged so much: a turned head is about half a deviation off the mean face."""

_FADES_OVER_LOOKS = 100.0
# A mean face from before a restart counts as so many looks: she, or the light, may be another.
_KNOWN_COUNTS_AS = 10.0
_COMPONENTS, _FITTED_EVERY_LOOKS = 12, 20
_PICTURES, _PICTURES_OF_A_LOOK = 120, 6
_RESIDUALS, _FEWEST_RESIDUALS = 50, 5
# What is left of her face beyond her components, relative to its median: others have 2.5 or more.
_STRANGE = 2.0
_STRANGE_LOOKS = 3


def standardised(faces: NDArray[np.integer]) -> NDArray[np.float32]:
    """Return faces uint8 (..., 30, 25) as numbers, each with mean 0 and deviation 1."""
    pictures = np.asarray(faces, np.float32)
    pictures = pictures - pictures.mean(axis=(-2, -1), keepdims=True)
    variance = np.square(pictures).mean(axis=(-2, -1), keepdims=True)
    return pictures / np.sqrt(variance + np.float32(LEAST_VARIANCE))


def contrasts(
    faces: NDArray[np.integer], mean_pictures: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return how faces uint8 (..., 30, 25) differ from mean faces, of deviation 1 or so."""
    return np.float32(CONTRAST_SCALE) * (standardised(faces) - mean_pictures)


def contrast(look: Look) -> NDArray[np.float32]:
    """Return how a look differs from her mean face, (30, 25); from grey where none is known."""
    mean_face = np.zeros(FACE_SHAPE, np.float32)
    return contrasts(look.face, mean_face if look.mean_face is None else look.mean_face.picture)


class MeanFaceTracker:
    """A running mean of her looks, each of the same weight, that restarts with another person.

    A person is another one when three looks in a row are beyond what the principal components of
    the looks before can show. It takes 25 looks until that can be noticed.
    """

    def __init__(self, known: MeanFace | None = None) -> None:
        """Start without a person, or with the one that was there before a restart."""
        self._person = 0 if known is None else known.person
        self._weight = 0.0 if known is None else _KNOWN_COUNTS_AS
        self._sum = np.zeros(FACE_SHAPE, np.float32)
        if known is not None:
            self._sum += self._weight * known.picture
        self._look: deque[NDArray[np.float32]] = deque(maxlen=4 * _PICTURES_OF_A_LOOK)
        self._strange_looks: list[NDArray[np.float32]] = []
        self._forget_components()

    def observe(self, face: NDArray[np.uint8], begins_look: bool) -> MeanFace:
        """Take the next picture of a look, uint8 (30, 25); return her mean face.

        That is of the looks before this one, and of this one as long as there is no other.
        """
        if begins_look and self._look:
            self._finish_look()
        if not (self._look or self._weight):
            self._person = zlib.crc32(face.tobytes())
        self._look.append(standardised(face))
        if self._weight:
            return MeanFace(self._person, self._sum / np.float32(self._weight))
        return MeanFace(self._person, np.mean(self._look, axis=0))

    def _finish_look(self) -> None:
        look = np.array(self._look)
        self._look.clear()
        self._strange_looks.append(look)
        if self._is_strange(look):
            if len(self._strange_looks) < _STRANGE_LOOKS:
                return
            self._begin_person()
        for each in self._strange_looks:
            self._add(each)
        self._strange_looks.clear()

    def _begin_person(self) -> None:
        first = self._strange_looks[0][0]
        self._person = zlib.crc32(first.tobytes())
        self._sum, self._weight = np.zeros(FACE_SHAPE, np.float32), 0.0
        self._forget_components()

    def _forget_components(self) -> None:
        self._looks = 0
        self._pictures: deque[NDArray[np.float32]] = deque(maxlen=_PICTURES)
        self._residuals: deque[float] = deque(maxlen=_RESIDUALS)
        self._centre = np.zeros(FACE_SHAPE[0] * FACE_SHAPE[1], np.float32)
        self._axes = np.zeros((0, len(self._centre)), np.float32)

    def _is_strange(self, look: NDArray[np.float32]) -> bool:
        if not len(self._axes):
            return False
        off = look.reshape(len(look), -1) - self._centre
        off = off - (off @ self._axes.T) @ self._axes
        residual = float(np.sqrt(np.square(off).mean(axis=1)).mean())
        known = len(self._residuals) >= _FEWEST_RESIDUALS
        if known and residual > _STRANGE * float(np.median(self._residuals)):
            return True
        self._residuals.append(residual)
        return False

    def _add(self, look: NDArray[np.float32]) -> None:
        keep = 1 - 1 / _FADES_OVER_LOOKS
        self._sum = keep * self._sum + look.mean(axis=0)
        self._weight = keep * self._weight + 1
        self._pictures.extend(_spread(look))
        self._looks += 1
        if self._looks % _FITTED_EVERY_LOOKS == 0:
            pictures = np.array(self._pictures).reshape(len(self._pictures), -1)
            self._centre = pictures.mean(axis=0)
            self._axes = _principal_axes(pictures - self._centre)


def _principal_axes(pictures: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the first axes (k, pixels) of few pictures (n, pixels), each of length 1.

    By their products with each other: an image waits for this, and a decomposition of the pictures
    themselves takes several times as long.
    """
    sizes, shares = np.linalg.eigh(pictures @ pictures.T)
    kept = np.flatnonzero(sizes > 1e-6 * max(float(sizes[-1]), 1e-12))[::-1][:_COMPONENTS]
    return np.asarray(shares[:, kept].T @ pictures / np.sqrt(sizes[kept])[:, None], np.float32)


def _spread(look: NDArray[np.float32]) -> Sequence[NDArray[np.float32]]:
    """Return a few of the pictures of a look, evenly spread: a long look counts as any other."""
    count = min(len(look), _PICTURES_OF_A_LOOK)
    return list(look[np.linspace(0, len(look) - 1, count).astype(int)])
