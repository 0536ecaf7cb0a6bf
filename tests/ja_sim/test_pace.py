"""When the next image is due."""

import pytest

from ja_sim.core.pace import Pace


def test_lockstep_goes_on_when_it_is_answered():
    pace = Pace(lockstep=True)
    assert not pace.is_due
    pace.record_answer()
    assert pace.is_due
    pace.record_image()
    assert not pace.is_due


@pytest.mark.parametrize(
    'order', [['record_answer', 'record_period'], ['record_period', 'record_answer']]
)
def test_lockstep_at_a_set_pace_needs_answer_and_period(order):
    pace = Pace(lockstep=True)
    pace.has_timer = True
    for event in order:
        assert not pace.is_due
        getattr(pace, event)()
    assert pace.is_due
    pace.record_image()
    pace.record_answer()
    assert not pace.is_due


def test_real_time_needs_the_period_alone():
    pace = Pace(lockstep=False)
    pace.has_timer = True
    assert not pace.is_due
    pace.record_period()
    assert pace.is_due


def test_a_pause_ends_by_steps_counted_or_by_going_on():
    pace = Pace(lockstep=False)
    with pytest.raises(ValueError, match='pause it'):
        pace.request_step()
    pace.set_paused(True)
    assert not pace.is_due
    pace.request_step()
    pace.request_step()
    for _ in range(2):
        assert pace.is_due
        pace.record_image()
    assert not pace.is_due
    pace.request_step()
    pace.set_paused(False)
    pace.set_paused(True)
    assert not pace.is_due, 'the step that was not taken is dropped'
    pace.set_paused(False)
    assert pace.is_due
