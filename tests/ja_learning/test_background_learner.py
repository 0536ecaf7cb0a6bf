"""Learning beside inference: who asks never waits for a lesson, unless it wants to."""

import threading

import numpy as np
import pytest

from ja_learning.core.background_learner import BackgroundLearner
from ja_learning.core.gaze_line import GazeLineConfig, GazeLineLearner
from made_up_trials import trial

PATIENCE_S = 10.0


class SlowLearner:
    """Knows how many lessons it had; every lesson lasts until it is allowed to end."""

    kind = 'slow'

    def __init__(self):
        self.trials = 0
        self.begun = threading.Semaphore(0)
        self.may_end = threading.Semaphore(0)

    def learn(self, lesson):
        self.begun.release()
        assert self.may_end.acquire(timeout=PATIENCE_S)
        if lesson is None:
            raise ValueError('nothing to learn from')
        self.trials += 1

    def snapshot(self):
        return f'after {self.trials}'


@pytest.fixture
def slow():
    return SlowLearner()


@pytest.fixture
def make():
    made = []

    def make_background(learner, learned=lambda learner: None):
        made.append(BackgroundLearner(learner, learned))
        return made[-1]

    yield make_background
    for background in made:
        background.close()


def test_the_snapshot_before_answers_until_the_lesson_is_over(make, slow):
    background = make(slow)
    background.learn(trial(0))
    assert slow.begun.acquire(timeout=PATIENCE_S)
    assert background.predictor == 'after 0'
    assert (background.trials, background.waiting) == (1, 1)
    slow.may_end.release()
    background.settle()
    assert background.predictor == 'after 1'
    assert (background.trials, background.waiting) == (1, 0)


def test_lessons_are_learned_one_by_one_in_the_order_in_which_they_came(make, slow):
    slow.may_end.release(5)
    learned = []
    background = make(slow, lambda learner: learned.append(learner.trials))
    for number in range(5):
        background.learn(trial(number))
    background.settle()
    assert learned == [1, 2, 3, 4, 5]
    assert background.troubles() == []


def test_what_is_done_with_the_learner_comes_after_the_lessons_and_shows(make, slow):
    slow.may_end.release(2)
    background = make(slow)
    background.learn(trial(0))
    background.learn(trial(1))

    def restore(learner):
        before, learner.trials = learner.trials, 10
        return before

    assert background.do(restore) == 2
    assert background.trials == 10
    assert background.predictor == 'after 10'


def test_a_lesson_that_fails_is_told_and_the_next_is_learned(make, slow):
    slow.may_end.release(2)
    background = make(slow)
    background.learn(None)
    background.learn(trial(0))
    background.settle()
    assert [str(error) for error in background.troubles()] == ['nothing to learn from']
    assert background.troubles() == []
    assert background.predictor == 'after 1'


def test_what_fails_after_a_lesson_is_told_and_the_lesson_is_kept(make, slow):
    def save(_learner):
        raise OSError('the disk is full')

    slow.may_end.release()
    background = make(slow, save)
    background.learn(trial(0))
    background.settle()
    assert [str(error) for error in background.troubles()] == ['the disk is full']
    assert background.predictor == 'after 1'
    with pytest.raises(OSError, match='the disk is full'):
        background.do(save)


def test_to_close_is_to_learn_what_was_handed_over(slow):
    background = BackgroundLearner(slow, lambda learner: None)
    background.learn(trial(0))
    slow.may_end.release()
    background.close()
    assert slow.trials == 1


def test_it_learns_what_it_would_have_learned_in_one_thread(make):
    config = GazeLineConfig(replay_steps=1)
    alone = GazeLineLearner(config, seed=3)
    background = make(GazeLineLearner(config, seed=3))
    for number in range(20):
        alone.learn(trial(number))
        background.learn(trial(number))
        # Asking meanwhile must disturb nothing.
        background.predictor.propose(trial(number).face, (0, 0), (0, 0), [(0.1, 0.2)])
    state = background.do(GazeLineLearner.state)
    for name, array in alone.state().items():
        np.testing.assert_array_equal(state[name], array, err_msg=name)
