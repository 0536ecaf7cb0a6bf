"""What a demo saves, what it prints where that is impossible, and who plays the caregiver."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from ja_bringup.cli import app
from ja_bringup.commands.demo import _head_of
from ja_bringup.demo import PHOTO_FILE, save_curve, with_photo
from ja_common.core.config import ConfigError
from ja_common.core.learning_curve import LearningCurve
from ja_runner.graph import sim_graph
from ja_sim.core.photo_head_file import PhotoHead, read_photo_head, write_photo_head
from picture_files import write_picture
from synthetic_pictures import room


@pytest.fixture
def curve():
    """Return what a progress node has of two trials."""
    curve = LearningCurve()
    for success in (True, False):
        curve.record_trial(success, 0.5, 1.0)
    return SimpleNamespace(curve=curve, track='strict', weight_files={'face.onnx': 'a' * 64})


def test_the_curve_is_saved(curve, tmp_path):
    saved, lines = save_curve(curve, tmp_path)
    assert saved
    assert [line.split()[-1] for line in lines] == [
        str(tmp_path / 'success_curve.csv'), str(tmp_path / 'success_curve.png')
    ]  # fmt: skip
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        'success_curve.csv', 'success_curve.png'
    ]  # fmt: skip


def test_a_curve_that_cannot_be_saved_is_printed(curve, tmp_path):
    folder = tmp_path / 'gone'
    folder.write_text('a file in the place of the folder')
    saved, [*table, error] = save_curve(curve, folder)
    assert not saved
    assert [row['success'] for row in csv.DictReader(table)] == ['1', '0']
    assert error.startswith(f'error: {folder}/success_curve.csv cannot be written')


@pytest.fixture
def head() -> PhotoHead:
    """Return the smallest head that a file may hold."""
    corners = np.eye(4, 3, dtype=np.float32) / 10
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]], np.int32)
    uv, texture = np.zeros((4, 2), np.float32), np.zeros((16, 16, 3), np.uint8)
    return PhotoHead(corners, faces, uv, texture, np.zeros((2, 3)), *np.zeros((3, 3)))


def test_a_photo_is_saved_in_the_run_and_shown_by_the_sim_alone(head, tmp_path):
    graph = sim_graph(3, {'scene': 'easy'})
    changed = with_photo(graph, head, tmp_path)
    photo = tmp_path / PHOTO_FILE
    np.testing.assert_array_equal(read_photo_head(photo).faces, head.faces)
    for before, after in zip(graph, changed, strict=True):
        added = {'photo': str(photo)} if before.executable == 'sim' else {}
        assert after.parameters == {**before.parameters, **added}


def test_a_head_that_was_made_before_is_read(head, tmp_path):
    path = write_photo_head(tmp_path / 'me.npz', head)
    np.testing.assert_array_equal(_head_of(path).vertices, head.vertices)


def test_the_demo_refuses_a_photo_without_a_face(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    photo = write_picture(tmp_path / 'wall.png', room())
    done = CliRunner().invoke(app, ['demo', '--caregiver', photo])
    assert isinstance(done.exception, ConfigError)
    assert "no face is found in '" in str(done.exception)
    assert not (tmp_path / 'runs').exists(), 'nothing is left of a run that did not begin'
