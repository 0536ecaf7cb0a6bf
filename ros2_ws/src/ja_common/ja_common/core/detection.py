"""One object or face in one image, as the detector reports it."""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Kind(IntEnum):
    """The kind of thing that a detection shows."""

    OBJECT = 0
    FACE = 1


class Detection(NamedTuple):
    """One object or face in one image.

    `x`, `y`: ray in the optical frame, z = 1 (lens distortion removed). `u`, `v`, `width`,
    `height`: centre and size of its box in the image [px]. `score`: the weighted sum of Eq. 1 for
    an object, the detector's confidence for a face. `f_col`, `f_edg`, `f_mot`: the features of
    Eq. 1, each 0-1. `attended`: a face that stands in the centre while the head is still, of which
    `face_image` of the same stamp shows the picture. `gaze_read`: an attended face of which
    `face_gaze` of the same stamp holds the head pose and the eyes. `range_m`: the distance from
    the camera [m] along the ray, and `range_deviation_m` its spread; NaN where it is not known.
    """

    kind: Kind
    x: float
    y: float
    u: float
    v: float
    width: float
    height: float
    score: float
    track_id: int = -1
    f_col: float = 0.0
    f_edg: float = 0.0
    f_mot: float = 0.0
    attended: bool = False
    gaze_read: bool = False
    range_m: float = math.nan
    range_deviation_m: float = math.nan

    @property
    def ray(self) -> NDArray[np.float64]:
        """Return the ray (x, y) in the optical frame, shape (2,)."""
        return np.array([self.x, self.y])

    @property
    def range(self) -> NDArray[np.float64]:
        """Return the distance from the camera and its deviation, (2,) [m]; NaN if unknown."""
        return np.array([self.range_m, self.range_deviation_m])


def objects(detections: list[Detection]) -> list[Detection]:
    """Return the objects among the detections."""
    return [d for d in detections if d.kind is Kind.OBJECT]


def most_salient(detections: list[Detection]) -> Detection | None:
    """Return the object i_trg of Eq. 1, or None when no object is in view."""
    return max(objects(detections), key=lambda d: d.score, default=None)


def caregiver_face(detections: list[Detection]) -> Detection | None:
    """Return the caregiver's face, the first of the faces, or None when no face is in view."""
    return next((d for d in detections if d.kind is Kind.FACE), None)
