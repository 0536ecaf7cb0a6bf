"""Schedules: drawn, written, read, and refused with one clear sentence."""

from itertools import pairwise
from pathlib import Path

import pytest

from ja_caregiver.core.schedule import (
    Rearrangement,
    Schedule,
    ScheduledLook,
    format_schedule,
    load_schedule,
    make_schedule,
    parse_schedule,
    save_schedule,
)
from ja_common.core.config import ConfigError

HEADER = 'kind,camera_s,start_s,end_s,thing,u,v,things\n'


def test_the_same_seed_gives_the_same_schedule():
    assert make_schedule(3, 20, 5) == make_schedule(3, 20, 5)
    assert make_schedule(3, 20, 5) != make_schedule(4, 20, 5)


def test_no_thing_comes_twice_in_turn_and_all_come():
    asked = [look.thing for look in make_schedule(0, 200, 5).looks]
    assert all(one != other for one, other in pairwise(asked))
    assert set(asked) == {1, 2, 3, 4, 5}


def test_one_thing_is_asked_for_again_and_again():
    assert [look.thing for look in make_schedule(0, 3, 1).looks] == [1, 1, 1]


def test_things_are_moved_every_few_looks_and_times_follow_each_other():
    schedule = make_schedule(0, 12, 5, rearrange_every=5)
    kinds = [isinstance(each, Rearrangement) for each in schedule.segments]
    assert kinds == [False] * 5 + [True] + [False] * 5 + [True] + [False] * 2
    begins = [
        each.start_s if isinstance(each, Rearrangement) else each.camera_s
        for each in schedule.segments
    ]
    assert begins[1:] == [each.end_s for each in schedule.segments[:-1]]


def test_twice_the_pace_takes_half_the_time():
    slow, fast = make_schedule(0, 10, 3, 1.0), make_schedule(0, 10, 3, 2.0)
    lead = slow.looks[0].camera_s
    assert fast.end_s - lead == pytest.approx((slow.end_s - lead) / 2)


@pytest.mark.parametrize(
    ('trials', 'things', 'pace', 'every'),
    [(0, 5, 1, 5), (5, 0, 1, 5), (5, 21, 1, 5), (5, 5, 0.0, 5), (5, 5, float('nan'), 5),
     (5, 5, 1, -1), (10**6, 5, 1, 5)],
)  # fmt: skip
def test_a_schedule_that_cannot_be_made_is_refused(trials, things, pace, every):
    with pytest.raises(ConfigError):
        make_schedule(0, trials, things, pace, every)


def test_what_was_saved_is_read_again(tmp_path: Path):
    made = make_schedule(1, 12, 4)
    save_schedule(made, tmp_path / 'plan.csv')
    assert load_schedule(tmp_path / 'plan.csv') == made


def test_places_settings_and_rearrangements_survive_the_file():
    first, second = ((0.1, 0.5), (0.9, 0.5)), ((0.2, 0.25), (0.75, 0.125))
    schedule = Schedule(
        (
            ScheduledLook(1.0, 2.0, 4.0, 2, first),
            ScheduledLook(4.0, 5.0, 7.0, 1, first),
            Rearrangement(7.0, 9.0),
            ScheduledLook(9.0, 10.0, 12.0, 1, second),
        ),
        view_deg=70.0,
        offset_s=-0.5,
    )
    assert parse_schedule(format_schedule(schedule), 'plan') == schedule


def test_places_of_looks_number_the_things_from_left_to_right():
    text = HEADER + (
        'look,1,2,4,,0.8,0.5,\nlook,4,5,7,,0.1,0.4,\nlook,7,8,9,,0.805,0.5,\n'
        'rearrange,9,,11,,,,\nlook,11,12,14,,0.5,0.5,\n'
    )
    looks = parse_schedule(text, 'plan').looks
    assert [look.thing for look in looks] == [2, 1, 2, 1]
    assert looks[0].things == ((0.1, 0.4), (0.8, 0.5))
    assert looks[3].things == ((0.5, 0.5),), 'what was moved has other numbers'


def test_the_nearest_of_the_listed_things_is_looked_at():
    text = HEADER + 'look,1,2,4,,0.6,0.5,0.9 0.5;0.5 0.5\n'
    (look,) = parse_schedule(text, 'plan').looks
    assert look.thing == 2


def test_places_of_a_line_hold_until_the_next_and_end_when_things_are_moved():
    text = HEADER + (
        'look,1,2,4,1,,,0.1 0.5;0.9 0.5\nlook,4,5,7,2,,,\nrearrange,7,,8,,,,\nlook,8,9,10,1,,,\n'
    )
    looks = parse_schedule(text, 'plan').looks
    assert looks[0].things == looks[1].things == ((0.1, 0.5), (0.9, 0.5))
    assert looks[2].things == ()


def test_columns_in_another_order_remarks_and_empty_lines_are_read():
    text = '# mine\n\nthing,end_s,start_s,camera_s,kind\n2,4,3,1,look\n,,,,\n'
    assert parse_schedule(text, 'plan').looks == (ScheduledLook(1, 3, 4, 2),)


def test_places_that_are_not_known_are_asked_for():
    with pytest.raises(ConfigError, match='look 1 gives thing 1 by its number only'):
        make_schedule(0, 2, 1).check_places('plan.csv')


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('', 'no look'),
        (HEADER, 'no look'),
        ('a,b\n1,2\n', 'plan:1: the first line names the columns'),
        ('kind,kind,camera_s,start_s,end_s\n', 'each once'),
        (HEADER + 'jump,1,2,3,1,,,\n', "plan:2: kind is 'look' or 'rearrange', not 'jump'"),
        (HEADER + 'look,1,2,3\n', 'a look has a thing, or u and v'),
        (HEADER + 'look,1,2,3,1,0.5,0.5,\n', 'one of both'),
        (HEADER + 'look,1,2,3,,0.5,,\n', 'one of both'),
        (HEADER + 'look,3,2,4,1,,,\n', 'must increase'),
        (HEADER + 'look,1,2,2,1,,,\n', 'must increase'),
        (HEADER + 'look,1,2,3,1,,,\nlook,2,4,5,1,,,\n', 'plan:3: camera_s = 2 lies before'),
        (HEADER + 'look,one,2,3,1,,,\n', "camera_s = 'one' is no number"),
        (HEADER + 'look,nan,2,3,1,,,\n', 'outside'),
        (HEADER + 'look,-1,2,3,1,,,\n', 'outside'),
        (HEADER + 'look,1,2,inf,1,,,\n', 'outside'),
        (HEADER + 'look,1,2,3,1.5,,,\n', 'no whole number'),
        (HEADER + 'look,1,2,3,0,,,\n', 'outside'),
        (HEADER + 'look,1,2,3,,1.5,0.5,\n', 'u = 1.5 is outside'),
        (HEADER + 'look,1,2,3,3,,,0.1 0.5;0.9 0.5\n', 'thing 3 of only 2 places'),
        (HEADER + 'look,1,2,3,1,,,0.1;0.9 0.5\n', 'thing 1 in the column things'),
        (HEADER + 'look,1,2,3,1,,,0.1 x\n', 'no number'),
        (HEADER + 'look,1,2,3,1,,,' + ';'.join(['0.1 0.5'] * 21) + '\n', 'at most 20'),
        (HEADER + 'look,1,2,3,1,,,,,\n', '10 values for 8 columns'),
        (HEADER + 'rearrange,3,,2,,,,\nlook,4,5,6,1,,,\n', 'must increase'),
        ('# view_deg: 200\n' + HEADER + 'look,1,2,3,1,,,\n', 'view_deg = 200 is outside'),
        ('# offset_s: soon\n' + HEADER + 'look,1,2,3,1,,,\n', "offset_s = 'soon'"),
        (HEADER + 'look,1,2,3,"1,,,\n', 'CSV'),
        (HEADER + 'look,1,2,3,1,,,\n' * 5001, 'segment'),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_its_line(text: str, message: str):
    with pytest.raises(ConfigError, match=message) as caught:
        parse_schedule(text, 'plan')
    assert '\n' not in str(caught.value)
    assert str(caught.value).startswith('plan')


def test_a_missing_file_a_folder_and_a_picture_are_refused(tmp_path: Path):
    (tmp_path / 'picture.csv').write_bytes(b'\xff\xd8\xff\xe0' + bytes(100))
    for name in ('missing.csv', '.', 'picture.csv'):
        with pytest.raises(ConfigError):
            load_schedule(tmp_path / name)
