"""What a person looks like, from a few colours and pictures: enough to tell her from a passer-by.

A face that turns changes its picture, and the light changes every colour. So colours are compared
with that of the face in the same picture: the light and the exposure cancel. Pictures of the face
are kept for different turns of the head. Both are learned while the person is seen.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_perception.core.box import Box
from ja_perception.core.face_crop import crop_face

# Places of which the mean colour is taken, relative to the box of the face (in its sizes): offset
# from its centre (right, down), width and height.
_FACE = (0.0, 0.05, 0.5, 0.5)
_HAIR = (0.0, -0.72, 0.5, 0.16)
_CLOTHES = (0.0, 1.25, 0.9, 0.5)
# A place counts where so much of it is in the image.
_LEAST_IN_VIEW = 0.5
# Added to colours (grey levels): black is as good as dark grey.
_DARK = 8.0
# Groups of the numbers of a signature, and what one unit of difference is: natural logarithm of a
# ratio of colours. Of the simulator's people, 95 % of one person's pictures differ by less.
_GROUPS = ((slice(0, 3), 0.2), (slice(3, 6), 0.4), (slice(6, 8), 0.1))
# One unit of what two pictures of a face do not share (one minus their correlation).
_PICTURE_UNIT = 0.45
# No single group decides.
_MOST_UNITS = 1.5
_PICTURE_WIDTHS = 1.2
_FLAT_DEVIATION = 4.0
# A picture as similar as this to one that is kept shows the same turn of the head.
_SAME_TURN = 0.85
_MOST_PICTURES = 16
_COLOURS_OVER = 50
_ENOUGH_SIGHTINGS = 10

SAME_PERSON = 0.55
"""Greatest difference of one person's sightings. Measured with the simulator's people at random
light, distance and turn, seven sightings known: 1 % of the person's own sightings differ by more,
and 5 % of other people's by less."""

SURELY_OTHER = 0.8
"""A face that is where hers was, and alone, is another's from this difference on."""


@dataclass(frozen=True)
class Signature:
    """One sighting of a person.

    ``colours``, (8,): logarithms of the colours of clothes and hair relative to the face (3 each),
    and of the face's red and blue relative to its green; NaN where not in view. ``picture``,
    (750,) float32: the face, of mean 0 and length 1.
    """

    colours: NDArray[np.float64]
    picture: NDArray[np.float32]


def read_signature(image: NDArray[np.uint8], grey: NDArray[np.uint8], face: Box) -> Signature:
    """Return the signature of the person with a ``face`` in an (H, W, 3) RGB image.

    ``grey``: the same image, (H, W).
    """
    skin = _log_colour(image, face, *_FACE)
    hair, clothes = (_log_colour(image, face, *place) for place in (_HAIR, _CLOTHES))
    tone = [skin[0] - skin[1], skin[2] - skin[1]]
    width = _PICTURE_WIDTHS * face.width
    crop = crop_face(grey, Box(face.u, face.v, width, 1.2 * width)).astype(np.float32).ravel()
    crop -= crop.mean()
    length = float(np.linalg.norm(crop)) + _FLAT_DEVIATION * math.sqrt(crop.size)
    return Signature(np.concatenate([clothes - skin, hair - skin, tone]), crop / length)


def _log_colour(
    image: NDArray[np.uint8], face: Box, du: float, dv: float, width: float, height: float
) -> NDArray[np.float64]:
    """Return the logarithms of the mean colour of a place, (3,); NaN where too little is seen."""
    u, v = face.u + du * face.width, face.v + dv * face.height
    place = Box(u, v, width * face.width, height * face.height)
    left, top = max(round(place.left), 0), max(round(place.top), 0)
    part = image[top : max(round(place.top + place.height), 0)]
    part = part[:, left : max(round(place.left + place.width), 0)]
    if part.shape[0] * part.shape[1] <= _LEAST_IN_VIEW * place.area:
        return np.full(3, np.nan)
    return np.log(np.array(cv2.mean(part)[:3]) + _DARK)


class KnownPerson:
    """What is known of a person's appearance; it follows slow changes."""

    def __init__(self) -> None:
        self.sightings = 0
        self._colours = np.full(8, np.nan)
        self._counts = np.zeros(8)
        self._pictures: list[NDArray[np.float32]] = []

    @property
    def is_known(self) -> bool:
        """Return whether there were enough sightings to tell the person from another."""
        return self.sightings >= _ENOUGH_SIGHTINGS

    def learn(self, seen: Signature) -> None:
        """Learn from a sighting that is known to be of this person."""
        self.sightings += 1
        there = ~np.isnan(seen.colours)
        self._counts[there] = np.minimum(self._counts[there] + 1, _COLOURS_OVER)
        fresh = there & (self._counts == 1)
        self._colours[fresh] = seen.colours[fresh]
        step = (seen.colours - self._colours) / np.maximum(self._counts, 1)
        self._colours[there] += step[there]
        alike = [float(seen.picture @ kept) for kept in self._pictures]
        if alike and max(alike) > _SAME_TURN:
            # The one that is in use goes to the end: the first is then the oldest.
            self._pictures.append(self._pictures.pop(alike.index(max(alike))))
            return
        self._pictures = [*self._pictures[-_MOST_PICTURES + 1 :], seen.picture]

    def difference(self, seen: Signature) -> float:
        """Return how much a sighting differs, 0 to 1.5; ``SAME_PERSON`` divides same and other.

        0 where nothing is known yet.
        """
        if not self._pictures:
            return 0.0
        units = []
        for group, unit in _GROUPS:
            off = np.abs(seen.colours[group] - self._colours[group])
            if not np.isnan(off).any():
                units.append(min(float(off.mean()) / unit, _MOST_UNITS))
        alike = max(float(seen.picture @ kept) for kept in self._pictures)
        units.append(min((1 - alike) / _PICTURE_UNIT, _MOST_UNITS))
        return sum(units) / len(units)
