"""What a face detector finds, and the one interface that all face detectors share."""

from dataclasses import dataclass
from typing import Protocol

import cv2
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
    """Finds faces in one square of an image."""

    smallest_share: float
    """The smallest face found, as a share of the side of the square."""

    def find_faces(self, image: NDArray[np.uint8], square: Box) -> list[Face]:
        """Return the faces in ``square`` of an (H, W, 3) RGB image; it may reach beyond."""
        ...


def cut_square(image: NDArray[np.uint8], square: Box, side: int) -> NDArray[np.uint8]:
    """Return the part of ``image`` in ``square``, scaled to (side, side, 3); black outside."""
    height, width = image.shape[:2]
    left, top = round(square.left), round(square.top)
    size = round(square.width)
    x0, y0 = max(left, 0), max(top, 0)
    x1, y1 = min(left + size, width), min(top + size, height)
    cut = np.zeros((side, side, 3), np.uint8)
    if x1 <= x0 or y1 <= y0:
        return cut
    scale = side / size
    a, b = round((x0 - left) * scale), round((y0 - top) * scale)
    c, d = round((x1 - left) * scale), round((y1 - top) * scale)
    if c > a and d > b:
        shrink = cv2.INTER_AREA if scale < 0.75 else cv2.INTER_LINEAR
        cv2.resize(image[y0:y1, x0:x1], (c - a, d - b), dst=cut[b:d, a:c], interpolation=shrink)
    return cut


def suppress_non_maxima(faces: list[Face], most_overlap: float = 0.4) -> list[Face]:
    """Return the faces, most confident first, without those that one before overlaps."""
    kept: list[Face] = []
    for face in sorted(faces, key=lambda f: -f.score):
        if all(face.box.overlap(other.box) <= most_overlap for other in kept):
            kept.append(face)
    return kept
