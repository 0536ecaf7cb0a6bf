"""The benchmarks of learning, on looks that need no renderer and with few trials."""

import dataclasses

import numpy as np
import pytest

from ja_benchmarks.benchmarks import attention_in_the_loop, learning_senses, learning_speed
from ja_benchmarks.benchmarks.learning_speed import (
    FULL,
    QUICK,
    LearningPlan,
    LearningTask,
    WorldChange,
    curves,
    measure,
)
from ja_benchmarks.learner_alone import (
    ARRANGEMENTS,
    draw_question,
    draw_test,
    look_of,
    next_seed,
    success,
)
from ja_experiments.datasets.looks import Looks, LooksOrder
from ja_learning.core.mean_face import MeanFaceTracker
from synthetic_trials import synthetic_looks

PLAN = LearningPlan(
    range(2),
    26,
    10,
    (
        LearningTask(
            'few',
            3,
            (5, 8),
            kind='paper',
            changes=(WorldChange('another caregiver', (0, 4)),),
        ),
        LearningTask('labels', 3, (8,), kind='paper', labelled=True),
    ),
)


class PerfectLearner:
    """Proposes the first candidate, which is the attended one; or nothing."""

    log_evidence = 0.0

    def __init__(self, answers: bool = True) -> None:
        self._answers = answers

    def propose(self, look, posture, candidates, ranges=None):
        return candidates[0] - posture if self._answers else None


@pytest.fixture
def looks() -> Looks:
    faces, postures, directions = synthetic_looks()
    return Looks(faces, postures, postures, directions)


@pytest.fixture
def orders(looks: Looks, monkeypatch: pytest.MonkeyPatch) -> list[LooksOrder]:
    """Synthetic looks in place of rendered ones, in this process; the orders that were made."""
    made: list[LooksOrder] = []

    def here(title, run, tasks):
        return [run(*task) for task in tasks]

    monkeypatch.setattr(learning_speed, 'render_looks', made.extend)
    monkeypatch.setattr(learning_speed, 'run_in_processes', here)
    monkeypatch.setattr(
        learning_speed,
        'load_order',
        lambda order: looks[order.seed : order.seed + order.count],
    )
    return made


def test_each_mark_has_a_row_over_all_seeds(orders: list[LooksOrder]) -> None:
    rows = measure(PLAN)
    assert list(rows) == [
        'paper, few: 5 trials',
        'paper, few: 8 trials',
        'paper, few, another caregiver after 8: 0 more trials',
        'paper, few, another caregiver after 8: 4 more trials',
        'paper, labels: 8 trials',
    ]
    assert all(row['n'] == 2 and 0 <= row['value'] <= 1 for row in rows.values())
    assert set(orders) == {LooksOrder('default', 0, 36), LooksOrder('default', 1, 36)}


@pytest.mark.usefixtures('orders')
def test_a_branch_continues_as_one_run_through_the_change_would() -> None:
    of_same_person = dataclasses.replace(PLAN, seeds=range(1))
    task = PLAN.tasks[0]
    branched = curves(of_same_person, task, 0)
    names = [f'few, another caregiver after 8: {mark} more trials' for mark in (0, 4)]
    # Where she stays the same person, the trials after the change are her first ones once more.
    run = learning_speed._LearningRun(
        of_same_person,
        task,
        0,
        learning_speed.make_learner('paper', 0),
        MeanFaceTracker(),
        np.random.default_rng([0, 3]),
    )
    looks = learning_speed.load_order(of_same_person.looks(0))
    run.learn(looks, range(26), (8,))
    for index in range(learning_speed._WATCHED):
        run.watch(looks, index)
    alone = run.learn(looks, range(learning_speed._WATCHED, 26), (0, 4))
    assert [branched[f'paper, {name}'] for name in names] == list(alone.values())


def test_marks_leave_fresh_looks_for_the_test() -> None:
    for plan in (FULL, QUICK):
        for task in plan.tasks:
            assert task.pool or max(task.marks) <= plan.trials
            assert list(task.marks) == sorted(task.marks)
            for change in task.changes:
                order = plan.looks_after(change, plan.seeds[0])
                fresh = order.count - plan.test_looks - learning_speed._WATCHED
                assert max(change.marks) <= fresh


def test_seeds_of_reports_are_used_by_no_quick_form() -> None:
    reports = set(FULL.seeds) | set(learning_senses.SEEDS) | set(attention_in_the_loop.SEEDS)
    assert not reports & set(QUICK.seeds)


def test_the_loop_and_the_learner_alone_share_their_looks() -> None:
    assert FULL.looks(10).count == attention_in_the_loop.LOOKS
    assert set(attention_in_the_loop.SEEDS) <= set(FULL.seeds)
    assert next_seed(range(10, 15), 14) == 10


def test_a_question_has_the_attended_object_first_and_others_apart(looks: Looks) -> None:
    rng = np.random.default_rng(0)
    question = draw_question(rng, looks, 7, 5)
    assert np.allclose(question.places[0], looks.directions[7])
    off = question.places[:, None] - question.places
    assert np.radians(5) < np.hypot(*np.moveaxis(off, -1, 0))[np.triu_indices(5, 1)].min()
    assert np.isnan(question.ranges).all()
    trial = question.trial(rng)
    assert sorted(map(tuple, trial.candidates)) == sorted(map(tuple, question.places))
    assert (trial.look.face == look_of(looks, 7).face).all()
    labelled = question.trial(rng, labelled=True)
    assert np.allclose(labelled.candidates, looks.directions[7][None])
    elsewhere = draw_question(rng, looks, 7, 5, elsewhere=True)
    assert not np.isclose(elsewhere.places, looks.directions[7]).all(axis=1).any()


def test_ranges_have_the_error_that_is_asked_for(looks: Looks) -> None:
    far = dataclasses.replace(
        looks,
        face_distances=np.full(len(looks), 1.2),
        object_distances=np.full(len(looks), 0.8),
    )
    asked = list(draw_test(far, 3, seed=0, depth=0.1))
    assert len(asked) == ARRANGEMENTS * len(far)
    measured = np.array([question.ranges[0, 0] for question in asked])
    assert measured.mean() == pytest.approx(0.8, abs=0.02)
    assert measured.std() == pytest.approx(0.08, rel=0.15)
    assert np.allclose(asked[0].ranges[:, 1], 0.1 * asked[0].ranges[:, 0])
    assert asked[0].look.face_range[0] == pytest.approx(1.2, abs=0.6)


def test_no_answer_counts_as_chance(looks: Looks) -> None:
    asked = list(draw_test(looks[:5], 4, seed=0))
    assert success(PerfectLearner(), asked) == 1.0
    assert success(PerfectLearner(answers=False), asked) == pytest.approx(0.25)
