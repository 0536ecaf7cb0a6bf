"""What a face detector finds, and the one interface that all face detectors share."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ja_perception.core.box import Box


@dataclass(frozen=True)
class Face:
    """A face: its box, the detector's confidence 0-1, and key points where the detector has them.

    ``keypoints``, shape (n, 2) [px]: right eye, left eye, nose, mouth, right and left ear (of the
    person); shape (0, 2) for detectors without.
    """

    box: Box
    score: float
    keypoints: NDArray[np.float64]


class FaceFinder(Protocol):
    """Finds faces in one square look at an image."""

    smallest_share: float
    """The smallest face found, as a share of the side of the square looked at."""

    def find(self, image: NDArray[np.uint8], square: Box) -> list[Face]:
        """Faces in ``square`` of an (H, W, 3) RGB image; the square may reach beyond it."""
        ...


def without_doubles(faces: list[Face], most_overlap: float = 0.4) -> list[Face]:
    """The faces, most confident first, less those that a more confident one overlaps."""
    kept: list[Face] = []
    for face in sorted(faces, key=lambda f: -f.score):
        if all(face.box.overlap(other.box) <= most_overlap for other in kept):
            kept.append(face)
    return kept
