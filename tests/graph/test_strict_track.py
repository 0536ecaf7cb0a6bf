"""*strict* starts from the face detector alone: no other file of learned weights is opened."""

import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from ros_testing import PATIENCE_S

RUN = Path(__file__).parent.parent / 'strict_run.py'
MODELS = Path(str(files('ja_perception.models')))
INNATE = MODELS / 'blazeface_short_range.onnx'
"""The face detector, which the paper takes as innate."""
WORLD = Path(str(files('ja_sim'))) / 'assets'
"""The shapes of the simulated world, as arrays."""
WEIGHTS = (
    '.onnx', '.tflite', '.task', '.pb', '.caffemodel', '.weights', '.engine', '.pt', '.pth',
    '.ckpt', '.safetensors', '.h5', '.hdf5', '.keras', '.npz', '.npy', '.bin', '.pkl', '.pickle',
    '.joblib', '.gguf', '.model',
)  # fmt: skip
_BEGINNINGS = (b'\x93NUMPY', b'\x89HDF', b'GGUF')


def holds_weights(path: Path) -> bool:
    """Return whether a file is of a kind that holds learned weights, by its name or content."""
    if path.suffix.lower() in WEIGHTS:
        return True
    with path.open('rb') as file:
        start = file.read(4096)
    cascade = b'opencv-cascade' in start or b'opencv-haar' in start
    return start.startswith(_BEGINNINGS) or start[4:8] == b'TFL3' or cascade


def weights_opened(folder: Path, *arguments: str) -> set[Path]:
    """Run in a folder; return the files of weights that were opened, but the run's own."""
    log = folder / 'opened.txt'
    found = subprocess.run(
        [sys.executable, str(RUN), str(log), *arguments],
        cwd=folder, capture_output=True, text=True, timeout=PATIENCE_S,
    )  # fmt: skip
    assert found.returncode == 0, found.stdout + found.stderr
    opened = {Path(line) for line in log.read_text().splitlines()}
    return {
        path
        for path in opened
        if path.is_file()
        and not path.is_relative_to(folder)  # checkpoints and cached looks that it wrote itself
        and not path.is_relative_to('/proc')
        and path.parent != WORLD
        and holds_weights(path)
    }


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv('JA_CACHE', str(tmp_path / 'cache'))
    return tmp_path


def test_strict_robots_without_ros_open_the_face_detector_alone(folder):
    assert weights_opened(folder, 'robots', 'gaze_line', 'paper') == {INNATE}


@pytest.mark.parametrize('learner', ['gaze_line', pytest.param('paper', marks=pytest.mark.slow)])
def test_the_strict_graph_opens_the_face_detector_alone(domain, folder, learner):
    found = weights_opened(folder, 'demo', '--trials', '3', '--learner', learner)
    assert found == {INNATE}
    assert list(folder.glob('runs/*-demo/checkpoints/*.npz')), 'it has learned'


def test_the_audit_sees_weights_that_were_added_and_what_opencv_opens_without_python(
    domain, folder
):
    """The same graph with another face finder that reads her landmarks fails the tests above."""
    haar = ['--ros-args', '-p', 'salient_feature_detector:face_finder:=haar']
    found = weights_opened(folder, 'demo', '--trials', '1', '--senses', 'eyes', *haar)
    assert found >= {MODELS / 'face_landmark.onnx', MODELS / 'iris_landmark.onnx'}
    assert 'haarcascade_frontalface_default.xml' in {path.name for path in found}
    assert INNATE not in found
