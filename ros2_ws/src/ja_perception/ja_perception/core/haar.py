"""OpenCV's Haar cascade for frontal faces (Viola and Jones 2001)."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_common.core.weight_files import note_weights_at
from ja_perception.core.box import Box
from ja_perception.core.faces import Face, cut_square

# The OpenCV of Debian and Ubuntu has no `cv2.data`; its cascades are in the package opencv-data.
_SYSTEM_FOLDER = Path('/usr/share/opencv4/haarcascades')
_CUT_PX = 160
_LEAST_NEIGHBOURS = 5


def read_cascade(name: str) -> 'cv2.CascadeClassifier':
    """Return OpenCV's cascade of a name. Raises ConfigError if its file is not installed."""
    file = f'haarcascade_{name}.xml'
    shipped = getattr(cv2, 'data', None)
    folders = [Path(shipped.haarcascades)] if shipped else []
    for folder in (*folders, _SYSTEM_FOLDER):
        if (folder / file).is_file():
            return cv2.CascadeClassifier(str(note_weights_at(folder / file)))
    raise ConfigError(
        f'{file} is neither with OpenCV {cv2.__version__} nor in {_SYSTEM_FOLDER}: '
        'apt install opencv-data, or set face_finder to blazeface'
    )


class HaarFaces:
    """A finder without a network; it loses a face that turns beyond some 20 degrees.

    Raises ConfigError if the cascade is not installed.
    """

    smallest_share = 0.2

    def __init__(self) -> None:
        self._cascade = read_cascade('frontalface_default')

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
