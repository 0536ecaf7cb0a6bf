"""Bits a trial, and the ideal learner: in cases whose answer is known."""

import dataclasses
import json
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from ja_benchmarks.benchmarks.bits_a_trial import (
    MARKS,
    NONE_IS_ATTENDED,
    PRIORS,
    TASKS,
    bits_and_success,
    curve_rows,
    learned_ideally,
    mean_bits,
)
from ja_benchmarks.benchmarks.learning_senses import SensesTask
from ja_benchmarks.ceiling import ceiling
from ja_benchmarks.ideal_learner import (
    ANY_AFFINE,
    MIRRORED_ALIKE,
    IdealLearner,
    draw_head_trials,
    draw_maps,
    probabilities,
    read_heads,
)
from ja_benchmarks.rows import Row, mean_row
from ja_experiments.datasets.looks import Looks
from ja_learning.core.learner_registry import make_learner
from ja_sim.core.scene import Scene, load_scene
from synthetic_trials import synthetic_looks
from tools import make_bits_figure

THE_SAME = np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]])


@pytest.fixture(scope='module')
def scene() -> Scene:
    scene = load_scene('default')
    return dataclasses.replace(scene, objects=dataclasses.replace(scene.objects, count=3))


def test_bits_are_zero_by_chance_and_at_most_log2_of_the_candidates() -> None:
    assert mean_bits([0.25] * 6, 4) == pytest.approx(0.0)
    assert 1.9 < mean_bits([1.0], 4) < 2.0
    # A belief that is sure of the wrong object loses a finite number of bits.
    assert mean_bits([0.0], 4) == pytest.approx(np.log2(NONE_IS_ATTENDED))


def test_an_untrained_belief_has_probabilities_and_few_bits() -> None:
    faces, postures, directions = synthetic_looks()
    looks = Looks(faces, postures, postures, directions)[:10]
    belief = make_learner('gaze_line', 0).snapshot()
    bits, share = bits_and_success(belief, looks, SensesTask('pixels', 4, ()), 0, None)
    assert -4.4 < bits < 0.7
    assert 0 <= share <= 0.7


def test_the_map_that_is_true_reads_what_the_ceiling_reads() -> None:
    best = ceiling(trials=200)['ceiling, 5 objects, her head alone']['value']
    found = learned_ideally(ANY_AFFINE, 5, number=0, marks=(0, 1))
    assert found.shape == (3, 2)
    assert found[0, 0] < 0.5 < 1.6 < found[-1, 0]
    assert found[-1, 1] == pytest.approx(best, abs=0.1)


def test_a_reading_is_what_its_map_takes_to_the_head(scene: Scene) -> None:
    rng = np.random.default_rng(0)
    trials = draw_head_trials(scene, 20, rng)
    (true_map,) = draw_maps(ANY_AFFINE, rng, 1)
    readings = read_heads(trials.heads, true_map)
    again = readings @ true_map[:4].reshape(2, 2).T + true_map[4:]
    assert np.allclose(again, trials.heads)
    # To know the map of a reading, or to read the head itself, is the same.
    by_map = probabilities(true_map[None], readings, trials.tables)
    by_head = probabilities(THE_SAME, trials.heads, trials.tables)
    assert np.allclose(by_map, by_head)
    assert np.allclose(by_map.sum(axis=1), 1.0)


def test_the_ideal_learner_finds_the_sign_and_the_scale_in_a_few_trials(scene: Scene) -> None:
    rng = np.random.default_rng(1)
    true_map = np.array([-1.6, 0.0, 0.0, 0.6, 0.0, 0.2])
    taught, tested = (draw_head_trials(scene, count, rng) for count in (8, 50))
    learner = IdealLearner(MIRRORED_ALIKE, rng, particles=1000)
    for reading, table in zip(read_heads(taught.heads, true_map), taught.tables, strict=True):
        learner.update(reading, table)
    found = np.median(learner.maps(), axis=0)
    assert found == pytest.approx(true_map, abs=0.35)
    shares = probabilities(learner.maps(), read_heads(tested.heads, true_map), tested.tables)
    assert (shares.argmax(axis=1) == 0).mean() > 0.8


def test_the_interval_of_few_runs_is_wider_than_that_of_a_normal_distribution() -> None:
    row = mean_row([1.0, 2.0, 3.0], 'bits')
    low, high = row['interval']
    assert (row['value'], row['n']) == (2.0, 3)
    # Student: 4.303 standard errors of 1 / sqrt(3) to each side.
    assert (high - low) / 2 == pytest.approx(4.303 / np.sqrt(3), rel=1e-3)


def made_up_rows() -> dict[str, Row]:
    """Return rows of every learner, by the names that the benchmark gives them."""
    curve = np.stack([np.linspace(0, 2, len(MARKS)), np.linspace(0.2, 0.9, len(MARKS))], axis=1)
    runs = np.stack([curve, curve + 0.01])
    names = [task.name for task in TASKS]
    names += [f'{name}, {objects} objects' for name in PRIORS for objects in (5, 10)]
    rows = {key: row for name in names for key, row in curve_rows(name, MARKS, runs).items()}
    for objects in (5, 10):
        rows[f'map known, {objects} objects: bits'] = mean_row([2.0, 2.1], 'bits')
        rows[f'map known, {objects} objects: success'] = mean_row([0.9, 0.95], 'success')
    return {f'bits_a_trial/{name}': row for name, row in rows.items()}


def test_the_gain_a_trial_is_the_difference_between_marks() -> None:
    rows = curve_rows(
        'x', (0, 1, 5), np.array([[[0, 0], [1, 0], [2, 1]], [[0, 0], [1, 0], [4, 1]]])
    )
    assert rows['x: gain from 0 to 1 trials']['value'] == pytest.approx(1.0)
    assert rows['x: gain from 1 to 5 trials']['value'] == pytest.approx(0.5)
    assert rows['x: bits after 5 trials']['value'] == pytest.approx(3.0)


def test_the_figure_has_a_curve_of_every_learner(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = made_up_rows()
    for learner in make_bits_figure.STYLES:
        for objects in (5, 10):
            marks = make_bits_figure.rows_of(rows, learner, objects, 'bits')
            assert [trials for trials, *_ in marks] == list(MARKS), learner
    figures, picture = tmp_path / 'bits.json', tmp_path / 'learner' / 'bits.png'
    figures.write_text(json.dumps(rows))
    monkeypatch.setattr(make_bits_figure, 'OUTPUT', picture)
    monkeypatch.setattr(sys, 'argv', ['make_bits_figure.py', str(figures)])
    make_bits_figure.main()
    assert cv2.imread(str(picture)).std() > 10
