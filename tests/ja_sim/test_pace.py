"""When the world may go on."""

import pytest

from ja_sim.core.pace import Pace


def test_lockstep_goes_on_when_it_is_answered():
    pace = Pace(lockstep=True)
    assert not pace.is_due
    pace.answer()
    assert pace.is_due
    pace.made()
    assert not pace.is_due


@pytest.mark.parametrize('order', [['answer', 'beat'], ['beat', 'answer']])
def test_lockstep_at_a_set_pace_needs_answer_and_beat(order):
    pace = Pace(lockstep=True)
    pace.has_beat = True
    for event in order:
        assert not pace.is_due
        getattr(pace, event)()
    assert pace.is_due
    pace.made()
    pace.answer()
    assert not pace.is_due


def test_real_time_needs_the_beat_alone():
    pace = Pace(lockstep=False)
    pace.has_beat = True
    assert not pace.is_due
    pace.beat()
    assert pace.is_due


def test_a_pause_ends_by_steps_counted_or_by_going_on():
    pace = Pace(lockstep=False)
    with pytest.raises(ValueError, match='pause it'):
        pace.step()
    pace.pause(True)
    assert not pace.is_due
    pace.step()
    pace.step()
    for _ in range(2):
        assert pace.is_due
        pace.made()
    assert not pace.is_due
    pace.step()
    pace.pause(False)
    pace.pause(True)
    assert not pace.is_due, 'the step that was not taken is forgotten'
    pace.pause(False)
    assert pace.is_due
