"""What do eyes and depth add? The fast learner on each track, by the test of `learning_speed`.

Tracks are never mixed (`ja_learning.core.track`): *strict* reads the pixels of her face from
random initial weights, *landmarks* reads head pose and eyes that foreign weights have found; each
without ranges, or with ranges of her face and of all objects that are known to 3 % (a depth
sensor) or to 10 %. The readings are those of the detector's `GazeReader` on the rendered looks;
the ranges are the true distances with a Gaussian error. The robot looks, learns and is tested as
in `learning_speed`, on seeds that were not used in development. A look without a reading (a
blink, a head turned too far) counts as a choice by chance.

The ceilings are observers who know the scene, and her gaze exactly or with the errors of the
reader (`ceiling_of_senses`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ja_benchmarks.ceiling import ceiling_of_senses
from ja_benchmarks.learner_alone import (
    LOOKS,
    TEST_LOOKS,
    TRIALS,
    Question,
    draw_test,
    next_seed,
    practise,
    render_looks,
    success,
)
from ja_benchmarks.rows import Row, success_row
from ja_experiments.datasets.looks import Looks, LooksOrder, load_looks
from ja_experiments.processes import run_in_processes
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.learner_registry import make_learner
from ja_learning.core.mean_face import MeanFaceTracker
from ja_learning.core.track import Track
from ja_learning.core.trial import MeanFace

SEEDS = range(20, 30)


@dataclass(frozen=True)
class SensesTask:
    """A condition. `depth`: the error of ranges as a share of them; None: no ranges.

    `marks`: the trials after which success is measured; `change_at`: after so many trials she is
    another caregiver; 0: never.
    """

    face_reader: str
    objects: int
    marks: tuple[int, ...]
    depth: float | None = None
    change_at: int = 0

    @property
    def name(self) -> str:
        """Return the track and the rest of the condition."""
        config = GazeLineConfig(face_reader=self.face_reader)
        name = f'{Track.of_learner(config, self.depth is not None)}'
        if self.depth is not None:
            name += f' to {100 * self.depth:.0f} %'
        name += f', {self.objects} objects'
        return name + (f', another caregiver after {self.change_at}' if self.change_at else '')


CONDITIONS = (
    SensesTask('landmarks', 5, (5, 10, 15, 25, 50, 200)),
    SensesTask('landmarks', 10, (15, 25, 50, 100, 300, 600)),
    SensesTask('landmarks', 5, (15, 50, 200), depth=0.03),
    SensesTask('landmarks', 10, (15, 25, 50, 100, 300, 600), depth=0.03),
    SensesTask('landmarks', 10, (25, 100, 600), depth=0.1),
    SensesTask('landmarks', 5, (200, 201, 225), change_at=200),
    SensesTask('pixels', 5, (25, 50, 150), depth=0.03),
    SensesTask('pixels', 10, (100, 300, 600), depth=0.03),
)


def run() -> dict[str, Row]:
    """Measure the success of the learner alone: means over seeds with their 95 % intervals."""
    render_looks(LooksOrder('default', seed, LOOKS, senses=True) for seed in SEEDS)
    tasks = [(condition, seed) for condition in CONDITIONS for seed in SEEDS]
    found = dict(zip(tasks, run_in_processes('learning', curve, tasks), strict=True))
    rows: dict[str, Row] = {}
    for condition in CONDITIONS:
        curves = np.array([found[condition, seed] for seed in SEEDS])
        for mark, shares in zip(condition.marks, curves.T, strict=True):
            rows[f'{condition.name}: {mark} trials'] = success_row(shares)
    read = [np.isfinite(_looks(seed).gazes[:, 0]).mean() for seed in SEEDS]
    rows['looks of which landmarks were read'] = success_row(read)
    return rows | ceiling_of_senses()


def curve(condition: SensesTask, seed: int) -> list[float]:
    """Return the success of one learner alone, 0-1, after each of the marks."""
    objects, depth = condition.objects, condition.depth
    rng = np.random.default_rng([seed, objects])
    looks, others = _looks(seed), _looks(next_seed(SEEDS, seed))
    learner = make_learner('gaze_line', seed, GazeLineConfig(face_reader=condition.face_reader))
    tracker, found = MeanFaceTracker(), []
    for trial in range(1, max(condition.marks) + 1):
        changed = condition.change_at and trial > condition.change_at
        # At once: after the change, before the first trial with her.
        if changed and trial == condition.change_at + 1 and trial in condition.marks:
            found.append(success(learner.snapshot(), _test(others, condition, seed)))
        world = others if changed else looks
        index = (trial - 1 - (condition.change_at if changed else 0)) % TRIALS
        mean_face = practise(learner, tracker, rng, world, index, objects, depth)
        if trial in condition.marks and not (changed and trial == condition.change_at + 1):
            test = _test(world, condition, seed, mean_face)
            found.append(success(learner.snapshot(), test))
    return found


def _test(
    looks: Looks, condition: SensesTask, seed: int, mean_face: MeanFace | None = None
) -> Iterator[Question]:
    tested = looks[-TEST_LOOKS:]
    return draw_test(tested, condition.objects, seed, condition.depth, mean_face)


def _looks(seed: int) -> Looks:
    return load_looks('default', seed, LOOKS, senses=True)
