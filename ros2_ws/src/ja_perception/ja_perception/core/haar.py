"""OpenCV's Haar cascade for frontal faces (Viola and Jones 2001)."""

import cv2
import cv2.data
import numpy as np
from numpy.typing import NDArray

from ja_perception.core.box import Box
from ja_perception.core.faces import Face, cut_square

_CASCADE = 'haarcascade_frontalface_default.xml'
_CUT_PX = 160
_LEAST_NEIGHBOURS = 5


class HaarFaces:
    """A finder without a network; it loses a face that turns beyond some 20 degrees."""

    smallest_share = 0.2

    def __init__(self) -> None:
        self._cascade = cv2.CascadeClassifier(cv2.data.haarcascades + _CASCADE)

    def find_faces(self, image: NDArray[np.uint8], square: Box) -> list[Face]:
        """See ``FaceFinder.find_faces``. Twenty neighbours or more give a score of 1."""
        cut = cv2.cvtColor(cut_square(image, square, _CUT_PX), cv2.COLOR_RGB2GRAY)
        boxes, neighbours = self._cascade.detectMultiScale2(
            cut, scaleFactor=1.1, minNeighbors=_LEAST_NEIGHBOURS
        )
        scale = square.width / _CUT_PX
        faces = []
        for (x, y, w, h), count in zip(boxes, neighbours, strict=True):
            u, v = square.left + scale * (x + w / 2), square.top + scale * (y + h / 2)
            box = Box(float(u), float(v), float(scale * w), float(scale * h))
            faces.append(Face(box, min(1.0, 0.6 + count / 50), np.empty((0, 2))))
        return faces
