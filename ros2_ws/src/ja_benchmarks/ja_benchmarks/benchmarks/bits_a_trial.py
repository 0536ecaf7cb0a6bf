"""What is learned from a trial, in bits, and where trials are lost: beside an ideal learner.

A learner that knows nothing gives each of n candidates the probability 1 / n. One that knows what
she looks at gives the attended object 1, and has gained log2(n) bits; a wrong belief gains less
than nothing. So after each mark, the mean over test looks of log2(n p(attended | look)) is what
the trials have taught about the map from faces to gazes. Its growth a trial compares with log2(n),
the most that a trial can tell. Success is that of the learner alone, as in `learning_senses`.

A learner assumes that with a probability of 0.05 she attends to none of the candidates; then they
are equally probable. This is part of the belief that is scored, for the ideal learner as well, so
a look costs at most 4.3 bits.

The ideal learner (`ideal_learner`) reads her head to half a degree in the geometry of the scene,
and knows the scene. It starts without knowing what its reading means: any affine map, or one that
agrees with mirror images. The last rows are of an observer that knows the map.

To draw the figure of the docs:

    ./ja bench bits_a_trial --json bits.json
    .venv/bin/python tools/make_bits_figure.py bits.json
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_benchmarks.benchmarks.learning_senses import SensesTask
from ja_benchmarks.ideal_learner import (
    ANY_AFFINE,
    MIRRORED_ALIKE,
    IdealLearner,
    ReadingPrior,
    draw_head_trials,
    draw_maps,
    probabilities,
    read_heads,
)
from ja_benchmarks.learner_alone import LOOKS, draw_test, practise, render_looks, success
from ja_benchmarks.rows import Row, mean_row, success_row
from ja_experiments.datasets.looks import Looks, LooksOrder, load_looks
from ja_experiments.processes import run_in_processes
from ja_learning.core.gaze_line_belief import GazeLineBelief
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.learner_registry import make_learner
from ja_learning.core.mean_face import MeanFaceTracker
from ja_learning.core.trial import MeanFace
from ja_sim.core.scene import load_scene

SEEDS = range(10, 15)
OBJECTS = (5, 10)
TEST_LOOKS = 100
NONE_IS_ATTENDED = 0.05

MARKS = (0, 1, 2, 4, 8, 15, 25, 50, 100, 200, 400, 600)
TASKS = tuple(
    SensesTask(face_reader, objects, MARKS, depth)
    for face_reader, depth in (('pixels', None), ('landmarks', None), ('landmarks', 0.03))
    for objects in OBJECTS
)

IDEAL_RUNS = range(40)
IDEAL_MARKS = (0, 1, 2, 3, 4, 6, 8, 10, 15, 25)
PRIORS = {'ideal': ANY_AFFINE, 'ideal, knows mirror images': MIRRORED_ALIKE}


def run() -> dict[str, Row]:
    """Measure bits and success after each mark, and the gain a trial between the marks."""
    render_looks(LooksOrder('default', seed, LOOKS, senses=True) for seed in SEEDS)
    tasks = [(task, seed) for task in TASKS for seed in SEEDS]
    found = iter(run_in_processes('learning', learned, tasks))
    rows: dict[str, Row] = {}
    for task in TASKS:
        curves = np.array([next(found) for _ in SEEDS])
        rows |= curve_rows(task.name, MARKS, curves)
    ideal_tasks = [
        (prior, objects, number)
        for prior in PRIORS.values()
        for objects in OBJECTS
        for number in IDEAL_RUNS
    ]
    found = iter(run_in_processes('ideal', learned_ideally, ideal_tasks))
    known = {}
    for name in PRIORS:
        for objects in OBJECTS:
            curves = np.array([next(found) for _ in IDEAL_RUNS])
            rows |= curve_rows(f'{name}, {objects} objects', IDEAL_MARKS, curves[:, :-1])
            known[objects] = curves[:, -1]
    for objects, (bits, shares) in ((each, known[each].T) for each in OBJECTS):
        rows[f'map known, {objects} objects: bits'] = mean_row(bits, 'bits')
        rows[f'map known, {objects} objects: success'] = success_row(shares)
    return rows


def learned(task: SensesTask, seed: int) -> NDArray[np.float64]:
    """Return bits and success of one learner after each mark, (marks, 2)."""
    rng = np.random.default_rng([seed, task.objects])
    looks = load_looks('default', seed, LOOKS, senses=True)
    learner = make_learner('gaze_line', seed, GazeLineConfig(face_reader=task.face_reader))
    tracker, mean_face, found = MeanFaceTracker(), None, []
    for trial in range(max(task.marks) + 1):
        if trial:
            mean_face = practise(learner, tracker, rng, looks, trial - 1, task.objects, task.depth)
        if trial in task.marks:
            belief = learner.snapshot()
            assert isinstance(belief, GazeLineBelief)
            found.append(bits_and_success(belief, looks[-TEST_LOOKS:], task, seed, mean_face))
    return np.array(found)


def bits_and_success(
    belief: GazeLineBelief,
    looks: Looks,
    task: SensesTask,
    seed: int,
    mean_face: MeanFace | None,
) -> tuple[float, float]:
    """Return the mean bits that a belief has gained about these looks, and its success."""
    questions = list(draw_test(looks, task.objects, seed, task.depth, mean_face))
    of_attended = []
    for each in questions:
        shares = belief.probabilities(each.look, each.places, each.ranges)
        of_attended.append(1 / task.objects if shares is None else shares[0])
    return mean_bits(of_attended, task.objects), success(belief, questions)


def mean_bits(of_attended: ArrayLike, objects: int) -> float:
    """Return the mean bits gained by beliefs that give the attended object these probabilities."""
    mixed = (1 - NONE_IS_ATTENDED) * np.asarray(of_attended) + NONE_IS_ATTENDED / objects
    return float(np.log2(objects * mixed).mean())


def learned_ideally(
    prior: ReadingPrior, objects: int, number: int, marks: tuple[int, ...] = IDEAL_MARKS
) -> NDArray[np.float64]:
    """Return bits and success of the ideal learner after each mark, (marks + 1, 2).

    The last row is that of an observer that knows the map.
    """
    scene = load_scene('default')
    scene = dataclasses.replace(scene, objects=dataclasses.replace(scene.objects, count=objects))
    rng = np.random.default_rng([number, objects])
    true_maps = draw_maps(prior, rng, 1)
    taught, tested = (draw_head_trials(scene, n, rng) for n in (max(marks), TEST_LOOKS))
    readings, asked = (read_heads(each.heads, true_maps[0]) for each in (taught, tested))
    learner = IdealLearner(prior, rng)
    found = []

    def ask(maps: NDArray[np.float64]) -> None:
        shares = probabilities(maps, asked, tested.tables)
        right = (shares.argmax(axis=1) == 0).mean()
        found.append((mean_bits(shares[:, 0], objects), float(right)))

    for trial in range(max(marks) + 1):
        if trial:
            learner.update(readings[trial - 1], taught.tables[trial - 1])
        if trial in marks:
            ask(learner.maps())
    ask(true_maps)
    return np.array(found)


def curve_rows(name: str, marks: tuple[int, ...], curves: NDArray[np.float64]) -> dict[str, Row]:
    """Return the rows of curves (runs, marks, 2) of bits and success."""
    rows: dict[str, Row] = {}
    bits, shares = np.moveaxis(curves, -1, 0)
    for index, mark in enumerate(marks):
        rows[f'{name}: bits after {mark} trials'] = mean_row(bits[:, index], 'bits')
        rows[f'{name}: success after {mark} trials'] = success_row(shares[:, index])
    gains = np.diff(bits, axis=1) / np.diff(marks)
    for first, last, gain in zip(marks, marks[1:], gains.T, strict=False):
        rows[f'{name}: gain from {first} to {last} trials'] = mean_row(gain, 'bits a trial')
    return rows
