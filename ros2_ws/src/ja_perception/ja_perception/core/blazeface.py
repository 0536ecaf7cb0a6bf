"""BlazeFace short range (Bazarevsky et al. 2019) through OpenCV's DNN module."""

from importlib.resources import files

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_common.core.weight_files import read_weights
from ja_perception.core.box import Box
from ja_perception.core.faces import Face, cut_square

_MODEL = 'blazeface_short_range.onnx'
_INPUT = 128
# The grids of the network's two heads: cells a side, anchors a cell.
_GRIDS = ((16, 2), (8, 6))
# Boxes that share more (intersection over union) are of one face.
_SAME_FACE_IOU = 0.3


def _anchor_centres() -> NDArray[np.float32]:
    """Return the centres of the 896 anchors, shape (896, 2), as shares of the input's side."""
    grids = []
    for cells, anchors in _GRIDS:
        axis = (np.arange(cells, dtype=np.float32) + 0.5) / cells
        centres = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
        grids.append(np.repeat(centres, anchors, axis=0))
    return np.concatenate(grids)


def _read_network() -> 'cv2.dnn.Net':
    """Read the network, which is stored as ONNX: OpenCV reads TFLite from 4.8 on only."""
    content = read_weights(files('ja_perception.models') / _MODEL)
    try:
        return cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8))
    except (AttributeError, cv2.error):
        # A build without the dnn module or without protobuf, or an old one.
        raise ConfigError(
            f'OpenCV {cv2.__version__} cannot read the face detector {_MODEL}: install OpenCV '
            '4.6 or newer with its dnn module, or set face_finder to haar'
        ) from None


class BlazeFace:
    """The default face detector: about 2 ms a search on one core, heads turned up to 60 degrees.

    ``least_score`` is the confidence (0-1) below which a face is not reported. Raises ConfigError
    if this OpenCV cannot read the network.
    """

    smallest_share = 0.2

    def __init__(self, least_score: float = 0.4) -> None:
        self._net = _read_network()
        self._outputs = ['classificators', 'regressors']
        self._anchors = _anchor_centres()
        self._least_logit = float(np.log(least_score / (1 - least_score)))

    def find_faces(self, image: NDArray[np.uint8], square: Box) -> list[Face]:
        """See ``FaceFinder.find_faces``."""
        scale = _INPUT / square.width
        cut = cut_square(image, square, _INPUT)
        blob = cv2.dnn.blobFromImage(cut, 1 / 127.5, mean=(127.5, 127.5, 127.5))
        self._net.setInput(blob)
        logits, values = self._net.forward(self._outputs)
        logits = logits.reshape(-1)
        hits = np.flatnonzero(logits > self._least_logit)
        if not hits.size:
            return []
        # Each row: box centre, box size, six key points; offsets from the anchor in input pixels.
        values = values.reshape(-1, 8, 2)[hits].astype(np.float64)
        values[:, [0, 2, 3, 4, 5, 6, 7]] += _INPUT * self._anchors[hits, None, :]
        scores = 1 / (1 + np.exp(-logits[hits].astype(np.float64)))
        corner = np.array([square.left, square.top])
        faces = []
        for row, score in _blended(values, scores):
            # Input pixel i shows image pixel (i + 0.5) / scale - 0.5 of the square.
            points = row / scale
            points[[0, 2, 3, 4, 5, 6, 7]] += corner
            (u, v), (width, height) = points[:2].tolist()
            faces.append(Face(Box(u, v, width, height), score, points[2:]))
        return faces


def _blended(
    values: NDArray[np.float64], scores: NDArray[np.float64]
) -> list[tuple[NDArray[np.float64], float]]:
    """Suppress non-maxima: average overlapping boxes, weighted by their scores.

    Averaging instead of taking the best is what makes BlazeFace's box steady between frames.
    """
    left_top = values[:, 0] - values[:, 1] / 2
    right_bottom = values[:, 0] + values[:, 1] / 2
    areas = np.prod(values[:, 1], axis=1)
    order = np.argsort(-scores, kind='stable')
    faces = []
    while order.size:
        best = order[0]
        shared = np.minimum(right_bottom[best], right_bottom[order]) - np.maximum(
            left_top[best], left_top[order]
        )
        shared_area = np.prod(np.maximum(shared, 0), axis=1)
        iou = shared_area / (areas[best] + areas[order] - shared_area)
        same = order[iou > _SAME_FACE_IOU]
        if not same.size:
            same = order[:1]
        faces.append((np.average(values[same], axis=0, weights=scores[same]), float(scores[best])))
        order = order[~np.isin(order, same)]
    return faces
