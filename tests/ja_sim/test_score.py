"""The score: the first fixation of a trial decides, and only whole trials count."""

import math

import numpy as np
import pytest

from ja_common.core.statistics import Rate
from ja_sim.core.score import Score, TruthAt

LEFT, RIGHT, FAR = (0.3, 0.0), (-0.3, 0.1), (0.8, 0.0)
DIRECTIONS = np.array([LEFT, RIGHT, FAR])
S = 10**9


def truth(trial, attended=0, stamp_s=0, in_view=True):
    return TruthAt(stamp_s * S, trial, DIRECTIONS, attended if trial else -1, in_view)


@pytest.fixture
def score():
    """Return a score that has seen the world before the first look."""
    score = Score(window=4)
    score.score_image(truth(0), None)
    return score


def play(score, trial, fixations, **about):
    """Play one trial, an image per fixation (or None); return the trial before's outcome."""
    outcomes = [score.score_image(truth(trial, **about), f if f is None else np.array(f))
                for f in fixations]  # fmt: skip
    assert outcomes[1:] == [None] * (len(outcomes) - 1), 'a trial ends with the first of the next'
    return outcomes[0]


def test_success_is_told_when_the_next_trial_begins(score):
    assert play(score, 1, [None, None, (0.28, 0.01), None], stamp_s=7) is None
    outcome = play(score, 2, [None])
    assert (outcome.trial, outcome.stamp_ns, outcome.objects) == (1, 7 * S, 3)
    assert outcome.success
    assert outcome.attended == pytest.approx(LEFT)
    assert outcome.fixated == pytest.approx((0.28, 0.01))


def test_fixating_another_object_is_a_failure(score):
    play(score, 1, [(-0.3, 0.1)], attended=0)
    assert not play(score, 2, [None]).success


def test_first_fixation_decides(score):
    play(score, 1, [RIGHT, LEFT], attended=0)
    outcome = play(score, 2, [None])
    assert not outcome.success
    assert outcome.fixated == pytest.approx(RIGHT)


def test_trial_without_fixation_was_given_up(score):
    play(score, 1, [None])
    outcome = play(score, 2, [LEFT])
    assert outcome.fixated is None
    assert not outcome.success
    assert play(score, 3, [None]).success, 'nothing of the one before is left'


def test_what_happens_before_the_first_look_belongs_to_no_trial(score):
    assert play(score, 0, [LEFT]) is None
    assert play(score, 1, [None]) is None
    assert play(score, 2, [None]).fixated is None


def test_trial_cut_off_by_a_reset_does_not_count(score):
    play(score, 1, [LEFT])
    play(score, 2, [LEFT])
    assert play(score, 0, [None]) is None
    assert play(score, 1, [RIGHT]) is None
    assert not play(score, 2, [None]).success
    assert score.rates()['all'] == Rate(1, 2)


def test_trial_seen_only_in_part_does_not_count():
    score = Score()
    play(score, 41, [None])
    assert play(score, 42, [LEFT]) is None
    assert play(score, 43, [None]).trial == 42


def test_rates_by_view_and_number_of_objects(score):
    for trial, (fixation, in_view) in enumerate(
        [(LEFT, True), (RIGHT, True), (LEFT, False), (None, False), (LEFT, True)], start=1
    ):
        play(score, trial, [fixation], in_view=in_view)
    play(score, 6, [None])
    assert score.rates() == {
        'all': Rate(3, 5),
        'recent': Rate(2, 4),
        'in_view': Rate(2, 3),
        'out_of_view': Rate(1, 2),
        'objects_3': Rate(3, 5),
    }


def test_interval_is_wilsons():
    """For 8 of 10: (p + z^2/2n +- z sqrt(p(1-p)/n + z^2/4n^2)) / (1 + z^2/n), z = 1.959964."""
    z, p, n = 1.959964, 0.8, 10
    half = z * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2)) / (1 + z**2 / n)
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    assert Rate(8, 10).rate == 0.8
    assert Rate(8, 10).interval == pytest.approx((middle - half, middle + half), abs=1e-6)


def test_nothing_is_known_before_the_first_trial():
    assert math.isnan(Rate(0, 0).rate)
    assert Rate(0, 0).interval == (0.0, 1.0)
    assert Rate(0, 50).interval[0] == pytest.approx(0.0)


@pytest.mark.parametrize('early', [True, False])
@pytest.mark.parametrize(
    ('interrupted_s', 'fixations', 'counts'),
    [
        (7, [None, None], False),
        (8, [None, None], False),
        (7, [None, LEFT], False),
        (8, [None, LEFT], True),  # the fixation of that image had ended it
        (9, [None, LEFT], True),
        (6, [None, None], True),  # before its look
    ],
)
def test_an_interrupted_trial_does_not_count(score, early, interrupted_s, fixations, counts):
    def image(stamp_s, trial, fixation=None):
        fixation = None if fixation is None else np.array(fixation)
        return score.score_image(truth(trial, stamp_s=stamp_s), fixation)

    if early:
        score.interrupt_trial(interrupted_s * S)
    image(7, 1, fixations[0])
    image(8, 1, fixations[1])
    if not early:
        score.interrupt_trial(interrupted_s * S)
    assert (image(10, 2) is not None) == counts
    image(11, 2, LEFT)
    assert image(12, 3).success, 'the next one counts'
    assert score.rates()['all'].trials == 1 + counts


def test_an_interruption_before_a_reset_of_the_clock_is_forgotten(score):
    play(score, 1, [None], stamp_s=700)
    score.interrupt_trial(700 * S)
    score.score_image(truth(0, stamp_s=1), None)
    play(score, 1, [LEFT], stamp_s=2)
    assert play(score, 2, [None], stamp_s=3).success
