"""The files of the face detectors: read by every OpenCV that we support, or refused in a sentence.

The OpenCV of Ubuntu 24.04 (4.6.0) reads no TFLite, and has no `cv2.data`.
"""

from importlib.resources import files
from pathlib import Path

import cv2
import numpy as np
import pytest

from ja_common.core.config import ConfigError
from ja_perception.core import haar
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.box import Box
from ja_perception.core.haar import HaarFaces
from ja_perception.core.landmark_networks import FaceMesh, IrisFinder, TurnedSquare
from synthetic_pictures import draw_face, room

WHOLE = Box(159.5, 119.5, 320, 320)
# Of noise, as LiteRT computes it from the original files.
MESH_OF_NOISE = [
    (108.0832, 110.8424, -8.588),
    (108.8926, 133.7224, 0.0056),
    (145.6073, 58.4429, 4.1414),
]
CONFIDENCE_OF_NOISE = 1.5146992048043404e-05
LIDS_OF_NOISE = [(21.2119, 31.621), (29.8265, 27.4123)]
IRIS_OF_NOISE = [(37.8521, 33.5821), (38.2015, 36.2566)]


def two_faces() -> np.ndarray:
    picture = room()
    draw_face(picture, 150, 110, 80, 0.0)
    draw_face(picture, 240, 150, 60, 0.2)
    return picture


def test_blazeface_computes_what_the_original_tflite_file_does():
    """The expected numbers are of `face_detection_short_range.tflite`, with OpenCV 4.14."""
    large, small = BlazeFace().find_faces(two_faces(), WHOLE)
    for face, box, score, right_eye, left_ear in (
        (large, (149.98112, 118.32691, 80.53647, 80.53643), 0.905967,
         (134.42082, 100.12002), (185.46547, 108.76671)),
        (small, (239.44450, 156.39528, 58.60700, 58.60714), 0.889281,
         (228.89527, 141.29227), (266.37638, 151.94700)),
    ):  # fmt: skip
        found = (face.box.u, face.box.v, face.box.width, face.box.height)
        assert found == pytest.approx(box, abs=1e-4)
        assert face.score == pytest.approx(score, abs=1e-6)
        assert face.keypoints[[0, 5]] == pytest.approx(np.array([right_eye, left_ear]), abs=1e-4)


def test_landmark_networks_compute_what_the_original_tflite_files_do():
    """The expected numbers are of `face_landmark.tflite`, `iris_landmark.tflite`, with LiteRT."""
    picture = np.random.default_rng(0).integers(0, 256, (192, 192, 3), np.uint8)
    landmarks, confidence = FaceMesh().find_landmarks(picture, TurnedSquare(95.5, 95.5, 192, 0.0))
    assert landmarks[[0, 200, 467]] == pytest.approx(np.array(MESH_OF_NOISE), abs=1e-3)
    assert confidence == pytest.approx(CONFIDENCE_OF_NOISE, rel=1e-3)
    eye = IrisFinder().find_iris(picture[:64, :64], TurnedSquare(31.5, 31.5, 64, 0.0))
    assert eye.lids[[0, 12]] == pytest.approx(np.array(LIDS_OF_NOISE), abs=1e-3)
    assert eye.iris[[0, 4]] == pytest.approx(np.array(IRIS_OF_NOISE), abs=1e-3)


def test_each_model_stands_in_the_notice_with_its_licence():
    models = files('ja_perception.models')
    notice = (models / 'NOTICE.txt').read_text()
    assert 'Apache License' in notice
    others = {'NOTICE.txt', '__init__.py', '__pycache__'}
    names = {path.name for path in models.iterdir()} - others
    assert names
    assert all(name in notice for name in names)


def test_an_opencv_that_cannot_read_the_network_is_named(monkeypatch):
    def refuse(path: str) -> None:
        raise cv2.error('Unsupported operation')

    monkeypatch.setattr(cv2.dnn, 'readNetFromONNX', refuse)
    with pytest.raises(ConfigError, match=r'install OpenCV 4\.6 or newer .* to haar'):
        BlazeFace()
    monkeypatch.delattr(cv2.dnn, 'readNetFromONNX')
    with pytest.raises(ConfigError, match=f'OpenCV {cv2.__version__} cannot read the face'):
        BlazeFace()


def test_cascades_of_a_distribution_are_found(monkeypatch):
    folder = Path(cv2.data.haarcascades) if hasattr(cv2, 'data') else haar._SYSTEM_FOLDER
    monkeypatch.delattr(cv2, 'data', raising=False)
    monkeypatch.setattr(haar, '_SYSTEM_FOLDER', folder)
    assert HaarFaces().find_faces(room(), WHOLE) == []


def test_missing_cascades_are_named_with_their_package(monkeypatch, tmp_path):
    monkeypatch.delattr(cv2, 'data', raising=False)
    monkeypatch.setattr(haar, '_SYSTEM_FOLDER', tmp_path)
    with pytest.raises(ConfigError, match=r'haarcascade_frontalface_default\.xml .*opencv-data'):
        HaarFaces()
