"""The networks that find landmarks of a face and of an eye, through OpenCV's DNN module.

Face mesh: Kartynnik, Ablavatski, Grishchenko and Grundmann (2019), Real-time facial surface
geometry from monocular video on mobile GPUs. Iris: Ablavatski, Vakunov, Grishchenko, Raveendran
and Zhdanovich (2020), Real-time pupil tracking from monocular video for digital puppetry. Each
looks at a square that stands upright on the face or on the line between the corners of an eye.
"""

from importlib.resources import files
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_common.core.weight_files import read_weights
from ja_perception.core.eye_openness import is_open

_MESH_POINTS, _LID_POINTS = 468, 16
_MESH, _IRIS = 'face_landmark.onnx', 'iris_landmark.onnx'
_MESH_PX, _IRIS_PX = 192, 64


class TurnedSquare(NamedTuple):
    """A square in the image: centre (u, v) and side [px], turned clockwise by ``roll_rad``.

    ``mirrored``: it is read from right to left, because the iris network knows right eyes only.
    """

    u: float
    v: float
    side: float
    roll_rad: float
    mirrored: bool = False

    def to_image(self, points: NDArray[np.float64], cells: int) -> NDArray[np.float64]:
        """Return points (n, 2) of the cut, ``cells`` pixels wide, in pixels of the image."""
        return points @ self._turn(cells).T + self._origin(cells)

    def cut_from(self, image: NDArray[np.uint8], cells: int) -> NDArray[np.uint8]:
        """Return this part of an image (H, W, 3), (cells, cells, 3); borders are repeated."""
        cut_to_image = np.column_stack([self._turn(cells), self._origin(cells)])
        return cv2.warpAffine(
            image,
            cut_to_image,
            (cells, cells),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )

    def _turn(self, cells: int) -> NDArray[np.float64]:
        cosine, sine = np.cos(self.roll_rad), np.sin(self.roll_rad)
        turn = np.array([[cosine, -sine], [sine, cosine]]) * (self.side / cells)
        return turn * [-1.0, 1.0] if self.mirrored else turn

    def _origin(self, cells: int) -> NDArray[np.float64]:
        middle = np.full(2, (cells - 1) / 2)
        return np.array([self.u, self.v]) - self._turn(cells) @ middle


class FaceMesh:
    """468 landmarks of a face, in depth too. Raises ConfigError if OpenCV cannot read it."""

    def __init__(self) -> None:
        self._net = _read_network(_MESH)

    def find_landmarks(
        self, image: NDArray[np.uint8], square: TurnedSquare
    ) -> tuple[NDArray[np.float64], float]:
        """Return landmarks (468, 3) [px] of the face in ``square``, and how surely it is one, 0-1.

        The third coordinate is the depth in the same unit, smaller where nearer to the camera.
        """
        cut = square.cut_from(image, _MESH_PX)
        points, logit = _outputs(self._net, cut, ['conv2d_20', 'conv2d_30'])
        points = points.reshape(_MESH_POINTS, 3)
        # In the network's pixels 0 is the edge of the first one.
        found = square.to_image(points[:, :2] - 0.5, _MESH_PX)
        depth = points[:, 2:] * (square.side / _MESH_PX)
        return np.hstack([found, depth]), float(1 / (1 + np.exp(-logit[0])))


class EyeLandmarks(NamedTuple):
    """An eye: lids (16, 2) [px], iris (5, 2) [px], its centre first, and whether it is open."""

    lids: NDArray[np.float64]
    iris: NDArray[np.float64]
    open: bool


class IrisFinder:
    """The lids and the iris of an eye. Raises ConfigError if OpenCV cannot read the network."""

    def __init__(self) -> None:
        self._net = _read_network(_IRIS)

    def find_iris(self, image: NDArray[np.uint8], square: TurnedSquare) -> EyeLandmarks:
        """Return the landmarks of the eye in ``square`` of an (H, W, 3) RGB image."""
        cut = square.cut_from(image, _IRIS_PX)
        lids, iris = (
            points.reshape(-1, 3)[:, :2] - 0.5
            for points in _outputs(
                self._net, cut, ['output_eyes_contours_and_brows', 'output_iris']
            )
        )
        lids = lids[:_LID_POINTS]
        return EyeLandmarks(
            square.to_image(lids, _IRIS_PX),
            square.to_image(iris, _IRIS_PX),
            is_open(lids, cut),
        )


def _read_network(name: str) -> 'cv2.dnn.Net':
    """Read a network, which is stored as ONNX: OpenCV reads TFLite from 4.8 on only."""
    try:
        content = read_weights(files('ja_perception.models') / name)
        return cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8))
    except (AttributeError, OSError, cv2.error):
        # A build without the dnn module or without protobuf, or an old one; or no file.
        raise ConfigError(
            f'head pose and eyes are not read: OpenCV {cv2.__version__} cannot read {name} of '
            'ja_perception; install OpenCV 4.6 or newer with its dnn module, or set read_gaze to '
            'false'
        ) from None


def _outputs(
    net: 'cv2.dnn.Net', cut: NDArray[np.uint8], names: list[str]
) -> list[NDArray[np.float64]]:
    net.setInput(cv2.dnn.blobFromImage(cut, 1 / 255))
    return [np.asarray(values, float).ravel() for values in net.forward(names)]
