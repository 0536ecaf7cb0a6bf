"""Glances: which, in which order, and when not."""

import numpy as np
import pytest

from ja_learning.core.look_around import LookAround, LookAroundConfig

LOOK = np.array([0.1, -0.05])
KNOWS = 30.0
ASIDE = np.array([0.45, 0.0])
LEFT, RIGHT = LOOK + ASIDE, LOOK - ASIDE


def around(mode: str, **settings: float) -> LookAround:
    begun = LookAround(LookAroundConfig(look_around=mode, glance_pan_rad=0.45, **settings))
    begun.start_trial(LOOK, log_evidence=KNOWS)
    return begun


def believing(share_left: float, share_right: float, samples: int = 100):
    left, right = round(samples * share_left), round(samples * share_right)
    at = np.concatenate(
        [np.tile(LEFT, (left, 1)), np.tile(RIGHT, (right, 1)), np.tile(LOOK, (samples, 1))]
    )
    return lambda: at[:samples]


def never():
    raise AssertionError('the belief is not needed')


def test_off_there_are_no_glances():
    assert around('off').next_view(never) is None


def test_both_sides_are_taken_whatever_is_believed():
    views = around('both_sides')
    assert views.next_view(never) == pytest.approx(LEFT)
    assert views.observe_rest(LEFT + 0.01), 'no posture is met exactly'
    assert views.next_view(never) == pytest.approx(RIGHT)
    assert views.observe_rest(RIGHT)
    assert views.next_view(never) is None
    views.start_trial(LOOK, log_evidence=KNOWS)
    assert views.next_view(never) == pytest.approx(LEFT)


@pytest.mark.parametrize(
    ('left', 'right', 'wanted'), [(0.6, 0.2, LEFT), (0.2, 0.5, RIGHT), (0.05, 0.09, None)]
)
def test_the_side_that_may_well_show_it_is_worth_a_glance(left, right, wanted):
    found = around('where_worthwhile', glance_worth=0.1).next_view(believing(left, right))
    assert found is wanted if wanted is None else found == pytest.approx(wanted)


def test_a_learner_that_knows_nothing_looks_everywhere_and_so_gets_evidence():
    views = around('where_worthwhile')
    views.start_trial(LOOK, log_evidence=0.0)
    assert views.next_view(never) == pytest.approx(LEFT)
    assert views.observe_rest(LEFT)
    assert views.next_view(never) == pytest.approx(RIGHT)


def test_what_has_been_in_view_is_not_looked_for_again():
    views = around('where_worthwhile')
    views.observe_rest(LEFT)
    assert views.next_view(believing(0.9, 0.05)) is None


def test_after_the_shift_there_are_no_glances():
    views = around('both_sides')
    assert not views.observe_rest((0.3, 0.05))
    assert views.next_view(never) is None


@pytest.mark.parametrize(('mode', 'blind'), [('both_sides', True), ('where_worthwhile', False)])
def test_a_glance_that_follows_a_belief_is_no_evidence_for_it(mode, blind):
    views = around(mode)
    assert views.observe_rest(LOOK)
    assert views.observe_rest(LEFT) is blind
