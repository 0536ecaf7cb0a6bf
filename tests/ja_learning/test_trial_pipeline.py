"""The trial pipeline: which trials it hands over, in which order, and what it proposes."""

import math

import numpy as np
import pytest

from ja_common.core.detection import Detection, Kind
from ja_common.core.posture import Posture
from ja_learning.core.look_around import LookAroundConfig
from ja_learning.core.trial import FACE_SHAPE
from ja_learning.core.trial_pipeline import BELIEF_SAMPLES, TrialPipeline

FACE = np.full(FACE_SHAPE, 100, np.uint8)
FACE_SEEN = Detection(Kind.FACE, 0.0, 0.0, 0, 0, 1, 1, 1.0, attended=True)
TURN = np.array([0.3, 0.1])


class Log:
    """A predictor that logs when it is asked; `on_trial` logs into the same list."""

    log_evidence = 1.5

    def __init__(self):
        self.events = []

    def propose(self, look, posture, candidates, ranges=None):
        self.events.append('propose')
        return TURN

    def expected_gain(self, look, candidates, ranges=None):
        return 0.7 if len(candidates) > 1 else float('nan')

    def belief(self, look, rng, count):
        return np.tile(TURN, (count, 1))

    def on_trial(self, trial, posture):
        self.events.append('given up' if trial.fixation is None else 'fixated')
        self.trial, self.posture = trial, posture


class Head:
    """The images of a head that turns from one rest to the next."""

    def __init__(self, log):
        self.pipeline = TrialPipeline(lambda: log, log.on_trial, LookAroundConfig(), 0.05, seed=0)
        self.stamp_ns = 0

    def at(self, pan):
        self.stamp_ns += 100
        return Posture(self.stamp_ns, np.array([pan, 0.0]), np.zeros(2))

    def look(self):
        return self.pipeline.process_image(self.at(0.0), [FACE_SEEN], FACE)

    def rest(self, pan, rays=()):
        seen = [Detection(Kind.OBJECT, x, y, 0, 0, 1, 1, 1.0) for x, y in rays]
        return self.pipeline.process_image(self.at(pan), seen, None)


@pytest.fixture
def log():
    return Log()


@pytest.fixture
def head(log):
    return Head(log)


def test_a_fixation_hands_over_the_trial_with_the_posture_that_ended_it(head, log):
    head.look()
    head.rest(0.3, [(0.1, 0.0)])
    end = head.at(0.3)
    trial = head.pipeline.process_fixation(end, (0.4, 0.1))
    assert trial is log.trial
    assert log.posture is end
    assert trial.fixation == pytest.approx([0.4, 0.1])
    assert log.events == ['propose', 'propose', 'fixated']
    assert head.pipeline.process_fixation(head.at(0.3), (0.4, 0.1)) is None
    assert log.events[-1] == 'fixated', 'no second trial'


def test_a_look_proposes_before_it_hands_over_the_trial_that_was_given_up(head, log):
    head.look()
    head.rest(0.3, [(0.1, 0.0)])
    log.events.clear()
    head.look()
    assert log.events == ['propose', 'given up']
    assert len(log.trial.candidates) == 1


def test_nothing_is_proposed_between_trials(head, log):
    assert head.rest(0.0).delta is None
    assert log.events == []
    assert head.pipeline.draw_belief(np.random.default_rng(0)).shape == (0, 2)
    proposal = head.look()
    assert proposal.delta is TURN
    assert proposal.log_evidence == 1.5
    assert math.isnan(proposal.expected_gain)
    assert head.pipeline.draw_belief(np.random.default_rng(0)).shape == (BELIEF_SAMPLES, 2)
    head.pipeline.drop_trial()
    assert head.rest(0.3).delta is None


def test_an_interrupted_trial_is_never_handed_over(head, log):
    head.look()
    interrupted_ns = head.stamp_ns
    head.rest(0.3, [(0.1, 0.0)])
    head.pipeline.interrupt_trial(interrupted_ns)
    head.rest(0.5, [(0.1, 0.0)])
    assert head.pipeline.process_fixation(head.at(0.5), (0.6, 0.0)) is None
    head.look()
    assert not {'fixated', 'given up'} & set(log.events)
    head.rest(0.3, [(0.1, 0.0)])
    assert head.pipeline.process_fixation(head.at(0.3), (0.4, 0.0)) is not None, 'the next one'


def test_an_interruption_that_comes_late_leaves_the_next_trial_alone(head, log):
    head.look()
    interrupted_ns = head.stamp_ns
    head.look()
    head.pipeline.interrupt_trial(interrupted_ns)
    head.rest(0.3, [(0.1, 0.0)])
    assert head.pipeline.process_fixation(head.at(0.3), (0.4, 0.1)) is not None
