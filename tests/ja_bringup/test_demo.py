"""What a demo saves at its end, and what it prints where that is impossible."""

import csv
from types import SimpleNamespace

import pytest

from ja_bringup.demo import save_curve
from ja_common.core.learning_curve import LearningCurve


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
