"""How many trials until a learner knows what she looks at? The fast learner beside the paper's.

Each trial has a fresh look, each seed another caregiver, and every object that was seen is a
candidate. In the test the learner alone chooses among the objects of looks that it never learned
from. Each look is asked four times, with other objects beside the attended object. The paper's
network learns from the object that it happened to fixate, drawn among all that were seen, as in
its first stage; the object nearest to its proposal is taken. The ceilings are those of
`./ja bench world`, for an observer that knows the exact direction of her eyes, or of her head. A
third ceiling is the fast learner with the attended object as its label, which no robot has: the
most that its networks learn from as many pictures of her face.

The quick form is for every day, on caregivers of its own: the seeds of the whole are for reports.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace

import numpy as np

from ja_benchmarks.ceiling import ceiling
from ja_benchmarks.learner_alone import (
    TEST_LOOKS,
    TRIALS,
    draw_question,
    draw_test,
    load_order,
    next_seed,
    render_looks,
    success,
)
from ja_benchmarks.rows import Row, success_row
from ja_experiments.datasets.looks import POOL, Looks, LooksOrder
from ja_experiments.processes import run_in_processes
from ja_learning.core.learner import Learner
from ja_learning.core.learner_registry import make_learner
from ja_learning.core.mean_face import MeanFaceTracker
from ja_learning.core.trial import MeanFace


@dataclass(frozen=True)
class WorldChange:
    """After the last trial she is another caregiver, or sits in `another_room` (a scene).

    She is first looked at some times without a trial. Then success is measured at once, and after
    so many trials more, the `marks`.
    """

    name: str
    marks: tuple[int, ...]
    another_room: str = ''


@dataclass(frozen=True)
class LearningTask:
    """A condition of one kind of learner, and what may change after it.

    `marks`: the trials after which success is measured. `pool`: learn from so many looks, and be
    tested on them; 0: fresh looks. `labelled`: the attended object is the only candidate. Each of
    the `changes` continues from the learner as it is after the last mark.
    """

    name: str
    objects: int
    marks: tuple[int, ...]
    kind: str = 'gaze_line'
    reliability: float = 1.0
    pool: int = 0
    labelled: bool = False
    changes: tuple[WorldChange, ...] = ()


@dataclass(frozen=True)
class LearningPlan:
    """What is measured: with caregivers of these seeds, `trials` looks of each to learn from."""

    seeds: range
    trials: int
    test_looks: int
    tasks: tuple[LearningTask, ...]

    def looks(self, seed: int) -> LooksOrder:
        """Return the order of the looks at a caregiver."""
        return LooksOrder('default', seed, self.trials + self.test_looks)

    def looks_after(self, change: WorldChange, seed: int) -> LooksOrder:
        """Return the order of the looks after a change."""
        if change.another_room:
            return LooksOrder(change.another_room, seed, _TRIALS_ELSEWHERE + self.test_looks)
        return self.looks(next_seed(self.seeds, seed))


_WATCHED = 20
"""So many looks at her without a trial follow a change of the world, before the first test."""

_TRIALS_ELSEWHERE = _WATCHED + 50
_CHANGES = (
    WorldChange('another caregiver', (0, 25, 50)),
    WorldChange('another room', (0, 25, 50), another_room='bare_room'),
)
FULL = LearningPlan(
    range(10, 20),
    TRIALS,
    TEST_LOOKS,
    (
        LearningTask('5 objects', 5, (12, 25, 60, 100, 150, 400), changes=_CHANGES),
        LearningTask('10 objects', 10, (25, 50, 100, 200, 400, 600)),
        LearningTask('5 objects, pool of 125', 5, (100, 300), pool=POOL),
        LearningTask('10 objects, pool of 125', 10, (200, 400), pool=POOL),
        LearningTask('5 objects, 30 % of looks elsewhere', 5, (100, 200, 400), reliability=0.7),
        LearningTask('10 objects, with labels', 10, (200, 600), labelled=True),
        LearningTask('5 objects', 5, (12, 25, 60, 100, 150, 400), kind='paper'),
        LearningTask('10 objects', 10, (25, 50, 100, 200, 400, 600), kind='paper'),
    ),
)
QUICK = LearningPlan(
    range(6),
    100,
    80,
    (
        LearningTask('10 objects', 10, (50, 100)),
        LearningTask('5 objects', 5, (12, 25, 60)),
    ),
)


def run(quick: bool = False) -> dict[str, Row]:
    """Measure the success of the learner alone: means over seeds with their 95 % intervals."""
    if quick:
        return measure(QUICK)
    return measure(FULL) | ceiling()


def measure(plan: LearningPlan) -> dict[str, Row]:
    """Render what is not cached, and return the rows of all tasks of a plan."""
    changes = [change for task in plan.tasks for change in task.changes]
    render_looks(
        order
        for seed in plan.seeds
        for order in (plan.looks(seed), *(plan.looks_after(each, seed) for each in changes))
    )
    tasks = [(plan, task, seed) for task in plan.tasks for seed in plan.seeds]
    rows: dict[str, Row] = {}
    found = iter(run_in_processes('learning', curves, tasks))
    for _ in plan.tasks:
        of_seeds = [next(found) for _ in plan.seeds]
        for name in of_seeds[0]:
            rows[name] = success_row([shares[name] for shares in of_seeds])
    return rows


def curves(plan: LearningPlan, task: LearningTask, seed: int) -> dict[str, float]:
    """Return the success of one learner alone, 0-1, after each mark of a task and its changes."""
    rng = np.random.default_rng([seed, task.objects])
    run = _LearningRun(plan, task, seed, make_learner(task.kind, seed), MeanFaceTracker(), rng)
    looks = load_order(plan.looks(seed))
    shares = run.learn(looks, range(plan.trials), task.marks)
    found = {f'{task.kind}, {task.name}: {mark} trials': each for mark, each in shares.items()}
    for change in task.changes:
        name = f'{task.kind}, {task.name}, {change.name} after {max(task.marks)}'
        branch, elsewhere = run.branch(), load_order(plan.looks_after(change, seed))
        for index in range(_WATCHED):
            branch.watch(elsewhere, index)
        shares = branch.learn(elsewhere, range(_WATCHED, len(elsewhere)), change.marks)
        found |= {f'{name}: {mark} more trials': each for mark, each in shares.items()}
    return found


@dataclass(frozen=True)
class _LearningRun:
    """One learner on its way through the trials of a task."""

    plan: LearningPlan
    task: LearningTask
    seed: int
    learner: Learner
    mean_face: MeanFaceTracker
    rng: np.random.Generator

    def watch(self, looks: Looks, index: int) -> MeanFace:
        """Look at her, as one of these looks is; return her mean face."""
        return self.mean_face.observe(looks.faces[index], begins_look=True)

    def learn(self, looks: Looks, fresh: range, marks: tuple[int, ...]) -> dict[int, float]:
        """Learn from fresh looks up to the last mark; return the success after each."""
        task, found = self.task, {}
        tested = looks[: task.pool] if task.pool else looks[-self.plan.test_looks :]
        if 0 in marks:
            found[0] = self.test(tested)
        for trial in range(1, max(marks) + 1):
            look = int(self.rng.integers(task.pool)) if task.pool else fresh[trial - 1]
            elsewhere = self.rng.random() >= task.reliability
            question = draw_question(
                self.rng,
                looks,
                look,
                task.objects,
                elsewhere=elsewhere,
                mean_face=self.watch(looks, look),
            )
            self.learner.update(question.trial(self.rng, task.labelled))
            if trial in marks:
                found[trial] = self.test(tested)
        return found

    def test(self, looks: Looks) -> float:
        """Return the success of the learner alone as it is now, 0-1; nothing is learned."""
        mean_face = copy.deepcopy(self.mean_face).observe(looks.faces[0], begins_look=True)
        test = draw_test(looks, self.task.objects, self.seed, mean_face=mean_face)
        return success(self.learner.snapshot(), test)

    def branch(self) -> _LearningRun:
        """Return a copy that continues from here, while this one stays as it is."""
        learner = make_learner(self.task.kind, self.seed)
        learner.restore(self.learner.state())
        mean_face, rng = copy.deepcopy(self.mean_face), copy.deepcopy(self.rng)
        return replace(self, learner=learner, mean_face=mean_face, rng=rng)
