"""The complete set for one image, in any order of arrival."""

import pytest

from ja_common.core.stamp_join import StampJoin


def test_set_is_complete_with_the_last_key():
    join = StampJoin(['a', 'b', 'c'])
    assert join.collect_value('c', 1, 'C') is None
    assert join.collect_value('a', 1, None) is None, 'None is a value'
    assert join.collect_value('b', 1, 'B') == {'a': None, 'b': 'B', 'c': 'C'}


def test_stamps_are_kept_apart():
    join = StampJoin(['a', 'b'])
    join.collect_value('a', 1, 'a1')
    join.collect_value('a', 2, 'a2')
    assert join.collect_value('b', 1, 'b1') == {'a': 'a1', 'b': 'b1'}
    assert join.collect_value('b', 2, 'b2') == {'a': 'a2', 'b': 'b2'}


def test_sets_older_than_a_complete_one_are_dropped():
    join = StampJoin(['a', 'b'])
    join.collect_value('a', 1, 'old')
    join.collect_value('a', 2, 'new')
    join.collect_value('b', 2, 'new')
    assert join.collect_value('b', 1, 'old') is None
    assert join.missing() == {'a'}, 'a late value begins a set that stays incomplete'


def test_repeated_image_gives_a_set_again():
    join = StampJoin(['a', 'b'])
    for _ in range(2):
        assert join.collect_value('a', 7, 1) is None
        assert join.collect_value('b', 7, 2) == {'a': 1, 'b': 2}


def test_missing_names_who_is_silent():
    join = StampJoin(['a', 'b', 'c'])
    assert join.missing() == {'a', 'b', 'c'}
    join.collect_value('a', 1, 0)
    join.collect_value('b', 1, 0)
    join.collect_value('b', 2, 0)
    assert join.missing() == {'a', 'c'}, 'of the newest image'


def test_waiting_is_bounded():
    join = StampJoin(['a', 'b'], depth=2)
    for stamp in (1, 2, 3):
        join.collect_value('a', stamp, stamp)
    assert join.collect_value('b', 1, 1) is None
    assert join.collect_value('b', 3, 3) == {'a': 3, 'b': 3}


def test_old_sets_do_not_choke_a_clock_set_back():
    join = StampJoin(['a', 'b'], depth=3)
    for stamp in (101, 102, 103):
        join.collect_value('a', stamp, 'b never came')
    join.collect_value('a', 1, 'after the jump')
    assert join.collect_value('b', 1, 'too') is not None


def test_unknown_key_is_an_error():
    with pytest.raises(KeyError, match='not one of'):
        StampJoin(['a']).collect_value('b', 1, 0)
