"""How early is the learner right with a face code: of watching her, or of other people?

The tracks `self-supervised` and `synthetic others`, beside `strict` on the same trials: 5 objects,
all seen, fresh looks, and a test on looks that neither learner nor code had. Before its first
trial the learner of the first track watched her for a minute. The code of the second was trained
on trials with simulated people of whom none is the caregiver of the test: one code on one half of
the people, one on the other, and each caregiver is read with the code that does not know her.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from ja_benchmarks.learner_alone import (
    draw_test,
    load_order,
    practise,
    render_looks,
    success,
)
from ja_benchmarks.rows import Row, success_row
from ja_experiments.datasets.looks import IMAGE_SIZE, Looks, LooksOrder
from ja_experiments.face_codes import code_of_others, code_of_watching
from ja_experiments.processes import run_in_processes
from ja_learning.core.face_code import OTHERS, WATCHED, save_face_code
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.learner_registry import make_learner
from ja_learning.core.mean_face import MeanFaceTracker
from ja_learning.core.track import Track
from ja_sim.core.caregiver import identities
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld

SEEDS = range(10, 20)
SCENE, OBJECTS, MARKS, TEST_LOOKS = 'default', 5, (5, 10, 15, 25, 60), 150
WATCHED_S = 60.0
GUESSES = ('eigenfaces', WATCHED, OTHERS)


def run() -> dict[str, Row]:
    """Train the codes, and measure the learner alone with each: means over seeds."""
    render_looks(_order(seed) for seed in SEEDS)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run_in_processes('codes of others', train_others, [(folder, 0), (folder, 1)])
        tasks = [(guess, folder, seed) for guess in GUESSES for seed in SEEDS]
        found = iter(run_in_processes('learning', curve, tasks))
    rows: dict[str, Row] = {}
    for guess in GUESSES:
        track = Track.of_learner(GazeLineConfig(first_guess=guess))
        curves = [next(found) for _ in SEEDS]
        for mark, shares in zip(MARKS, zip(*curves, strict=True), strict=True):
            rows[f'{track}, {OBJECTS} objects: {mark} trials'] = success_row(shares)
    return rows


def train_others(folder: Path, half: int) -> None:
    """Train the code of one half of the people, and write it."""
    code = code_of_others(load_scene(SCENE), _people(half), seed=0)
    save_face_code(_code_file(folder, half), code)


def curve(guess: str, folder: Path, seed: int) -> list[float]:
    """Return the success of the learner alone, 0-1, after each of the marks."""
    looks, code = _looks(seed), ''
    if guess == WATCHED:
        watched = folder / f'{seed}.npz'
        save_face_code(watched, code_of_watching(load_scene(SCENE), seed, WATCHED_S, seed))
        code = str(watched)
    elif guess == OTHERS:
        knows_her = int(_person(seed) in _people(1))
        code = str(_code_file(folder, 1 - knows_her))
    learner = make_learner('gaze_line', seed, GazeLineConfig(first_guess=guess, face_code=code))
    rng, tracker, found = np.random.default_rng([seed, OBJECTS]), MeanFaceTracker(), []
    for trial in range(max(MARKS)):
        mean_face = practise(learner, tracker, rng, looks, trial, OBJECTS)
        if trial + 1 in MARKS:
            test = draw_test(looks[-TEST_LOOKS:], OBJECTS, seed, mean_face=mean_face)
            found.append(success(learner.snapshot(), test))
    return found


def _people(half: int) -> list[str]:
    return identities()[half::2]


def _code_file(folder: Path, half: int) -> Path:
    return folder / f'others-{half}.npz'


def _person(seed: int) -> str:
    """Return who the caregiver of a seed is."""
    world = JointAttentionWorld(load_scene(SCENE), seed, IMAGE_SIZE)
    try:
        return world.person
    finally:
        world.close()


def _order(seed: int) -> LooksOrder:
    return LooksOrder(SCENE, seed, max(MARKS) + TEST_LOOKS)


def _looks(seed: int) -> Looks:
    return load_order(_order(seed))
