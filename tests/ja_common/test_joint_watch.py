"""Foreign joints are normal; a joint of ours that stays away is named, with what to do."""

import pytest

from ja_common.core.joint_watch import JointWatch, nearest_name


def watch(messages, stated=(), missing_after_s=2.0):
    """Return a watch that got messages (time [s], names); `stated` joints had a position."""
    made = JointWatch({'pan': 'pan_joint', 'tilt': 'tilt_joint'}, missing_after_s)
    for now_s, names in messages:
        made.record_names(names, now_s)
        for name in names:
            if name in stated:
                made.record_position(name, now_s)
    return made


def every(seconds, *names, start_s=100.0):
    return [(start_s + 0.1 * i, names) for i in range(round(seconds * 10) + 1)]


def test_a_joint_that_stays_away_is_named_and_no_other():
    text = watch(every(3.0, 'pan', 'left_wheel'), stated=['pan']).explain_missing()
    assert "no position of 'tilt' for more than 2 s" in text
    assert "['left_wheel', 'pan']" in text
    assert "set tilt_joint to the name that your rig gives it (now 'tilt')" in text


def test_foreign_messages_between_ours_are_no_word_worth():
    mixed = every(5.0, 'pan') + every(5.0, 'wheel', start_s=100.03) + every(5.0, 'tilt')
    assert watch(sorted(mixed), stated=['pan', 'tilt']).explain_missing() == ''


@pytest.mark.parametrize('seconds', [0.5, 1.9])
def test_nothing_is_missing_at_the_start(seconds):
    assert watch(every(seconds, 'wheel')).explain_missing() == ''


def test_a_pause_of_the_whole_topic_is_not_the_joint_s():
    messages = [*every(3.0, 'pan', 'tilt'), (150.0, ('pan',))]
    assert watch(messages, stated=['pan', 'tilt']).explain_missing() == ''


def test_a_driver_that_ended_is_asked_for():
    messages = every(3.0, 'pan', 'tilt') + every(3.0, 'pan', start_s=103.1)
    text = watch(messages, stated=['pan', 'tilt']).explain_missing()
    assert "start the driver of 'tilt' again" in text


def test_why_positions_are_useless_is_said():
    made = watch(every(3.0, 'pan', 'tilt'), stated=['pan'])
    made.record_useless('tilt', 'without a position')
    assert "'tilt' comes without a position" in made.explain_missing()


def test_a_node_may_need_no_head():
    assert watch(every(9.0, 'wheel'), missing_after_s=None).explain_missing() == ''


def test_long_lists_of_joints_are_cut():
    text = watch(every(3.0, *(f'finger_{i}' for i in range(900)))).explain_missing()
    assert 'and 488 more' in text
    assert len(text) < 500


@pytest.mark.parametrize(
    ('name', 'names', 'near'),
    [
        ('pan', ['robot1/pan', 'robot1/tilt'], 'robot1/pan'),
        ('pan', ['head_pan_joint', 'wheel'], 'head_pan_joint'),
        ('head_pan', ['head_pna', 'wheel'], 'head_pna'),
        ('pan', ['wheel'], ''),
        ('tilt', [], ''),
    ],
)
def test_the_nearest_name_is_proposed(name, names, near):
    assert nearest_name(name, names) == near
    if near:
        text = watch(every(3.0, *names)).explain_missing()
        assert ("set pan_joint to the name, 'robot1/pan'?" in text) == (near == 'robot1/pan')
