"""Learning beside inference: no question waits for an update, except in lockstep."""

import threading

import numpy as np
import pytest

from ja_learning.core.background_learner import BackgroundLearner
from ja_learning.core.gaze_line import GazeLineLearner
from ja_learning.core.gaze_line_config import GazeLineConfig
from made_up_trials import trial
from ros_testing import PATIENCE_S


class SlowLearner:
    """Counts its updates; every update lasts until it is allowed to end."""

    kind = 'slow'

    def __init__(self):
        self.trials = 0
        self.begun = threading.Semaphore(0)
        self.may_end = threading.Semaphore(0)

    def update(self, trial):
        self.begun.release()
        assert self.may_end.acquire(timeout=PATIENCE_S)
        if trial is None:
            raise ValueError('nothing to learn from')
        self.trials += 1

    def snapshot(self):
        return f'after {self.trials}'


def wait_for_all(background):
    """Wait until all is learned."""
    background.call_with_learner(lambda learner: None)


@pytest.fixture
def slow():
    return SlowLearner()


@pytest.fixture
def make():
    made = []

    def make_background(learner, learned=lambda learner: None, behind=None):
        made.append(BackgroundLearner(learner, learned, behind))
        return made[-1]

    yield make_background
    for background in made:
        background.close(0.0)


def test_the_snapshot_before_answers_until_the_update_is_over(make, slow):
    background = make(slow)
    background.update(trial(0))
    assert slow.begun.acquire(timeout=PATIENCE_S)
    assert background.predictor == 'after 0'
    assert (background.trials, background.waiting) == (1, 1)
    slow.may_end.release()
    wait_for_all(background)
    assert background.predictor == 'after 1'
    assert (background.trials, background.waiting) == (1, 0)


def test_trials_are_learned_one_by_one_in_the_order_in_which_they_came(make, slow):
    slow.may_end.release(5)
    learned = []
    background = make(slow, lambda learner: learned.append(learner.trials))
    for number in range(5):
        background.update(trial(number))
    wait_for_all(background)
    assert learned == [1, 2, 3, 4, 5]
    assert background.pop_errors() == []


def test_a_function_is_called_with_the_learner_when_all_is_learned(make, slow):
    slow.may_end.release(2)
    background = make(slow)
    background.update(trial(0))
    background.update(trial(1))
    assert background.call_with_learner(lambda learner: learner.trials) == 2


def test_in_lockstep_the_same_updates_show_however_quick_they_were(make, slow):
    background = make(slow, behind=1)
    slow.may_end.release(2)
    background.update(trial(0))
    wait_for_all(background)
    assert background.predictor == 'after 0', 'the newest update never shows, though it is over'
    background.update(trial(1))
    assert background.predictor == 'after 1', 'the one before it is waited for'
    wait_for_all(background)
    assert background.predictor == 'after 1'


def test_an_update_that_fails_is_reported_and_the_next_trial_is_learned(make, slow):
    slow.may_end.release(2)
    background = make(slow)
    background.update(None)
    background.update(trial(0))
    wait_for_all(background)
    assert [str(error) for error in background.pop_errors()] == ['nothing to learn from']
    assert background.pop_errors() == []
    assert background.predictor == 'after 1'


def test_what_fails_after_an_update_is_reported_and_the_update_is_kept(make, slow):
    def save(_learner):
        raise OSError('the disk is full')

    slow.may_end.release()
    background = make(slow, save)
    background.update(trial(0))
    wait_for_all(background)
    assert [str(error) for error in background.pop_errors()] == ['the disk is full']
    assert background.predictor == 'after 1'
    with pytest.raises(OSError, match='the disk is full'):
        background.call_with_learner(save)


def test_close_learns_what_was_handed_over(slow):
    background = BackgroundLearner(slow, lambda learner: None)
    background.update(trial(0))
    slow.may_end.release()
    assert background.close(PATIENCE_S) is slow
    assert slow.trials == 1


def test_close_drops_what_would_take_too_long(slow):
    background = BackgroundLearner(slow, lambda learner: None)
    for number in range(3):
        background.update(trial(number))
    assert slow.begun.acquire(timeout=PATIENCE_S)
    threading.Timer(0.5, slow.may_end.release).start()
    assert background.close(0.0).trials == 1


def test_it_learns_what_it_would_have_learned_in_one_thread(make):
    config = GazeLineConfig(replay_steps=1)
    alone = GazeLineLearner(config, seed=3)
    background = make(GazeLineLearner(config, seed=3))
    for number in range(20):
        alone.update(trial(number))
        background.update(trial(number))
        # A question meanwhile must change nothing.
        background.predictor.propose(trial(number).look, (0, 0), [(0.1, 0.2)])
    state = background.call_with_learner(GazeLineLearner.state)
    for name, array in alone.state().items():
        np.testing.assert_array_equal(state[name], array, err_msg=name)
