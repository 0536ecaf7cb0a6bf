"""The success curve, counted by hand, and its files."""

import csv

import cv2
import numpy as np
import pytest

from ja_bringup.success_curve import CurveOrigin, draw_png, write_csv
from ja_common.core.learning_curve import LearningCurve


@pytest.fixture
def curve() -> LearningCurve:
    curve = LearningCurve()
    curve.stage = 'exam before'
    curve.record_trial(False, 1.0, 0.5)
    curve.stage = 'practice'
    for number, success in enumerate([True, True, False, True], start=1):
        curve.record_trial(success, 0.1 * number, float(number))
    return curve


def test_rate_over_the_last_trials_of_its_stage_only(curve):
    assert curve.recent_rates(2) == pytest.approx([0, 1, 1, 1 / 2, 1 / 2])
    assert curve.recent_rates(100) == pytest.approx([0, 1, 1, 2 / 3, 3 / 4])
    assert LearningCurve().recent_rates(2).shape == (0,)


def test_rate_of_a_part_and_of_a_stage(curve):
    assert (curve.rate().successes, curve.rate().trials) == (3, 5)
    last = curve.rate(slice(-2, None))
    assert (last.successes, last.trials) == (1, 2)
    practice = curve.rate(slice(2), stage='practice')
    assert (practice.successes, practice.trials) == (2, 2)


def test_csv_has_one_row_a_trial(curve, tmp_path):
    origin = CurveOrigin('strict with depth', {'face.onnx': 'a' * 64, 'b.onnx': 'b' * 64})
    rows = list(csv.DictReader(write_csv(curve, tmp_path, origin).open()))
    assert [row['trial'] for row in rows] == ['1', '2', '3', '4', '5']
    assert [row['success'] for row in rows] == ['0', '1', '1', '0', '1']
    assert [row['stage'] for row in rows] == ['exam before', *['practice'] * 4]
    assert float(rows[2]['p_lm']) == pytest.approx(0.2)
    assert {row['track'] for row in rows} == {'strict with depth'}
    assert {row['weight_files'] for row in rows} == {f'b.onnx={"b" * 16} face.onnx={"a" * 16}'}


def test_png_shows_what_was_learned(curve, tmp_path):
    picture = cv2.imread(str(draw_png(curve, tmp_path, window=2)))
    better = LearningCurve()
    for _ in range(5):
        better.record_trial(True, 0.5, 1.0)
    other = cv2.imread(str(draw_png(better, tmp_path, window=2)))
    assert picture.shape == other.shape
    assert np.abs(picture.astype(int) - other).mean() > 0.1
