"""Actions run in one order for every order of arrival."""

from itertools import permutations

import pytest

from ja_common.core.stamp_ordered_dispatcher import StampOrderedDispatcher


class Acted(list):
    """The actions that have run, in order; `queue` adds a message of a kind about an image."""

    def __init__(self) -> None:
        super().__init__()
        self._dispatcher = StampOrderedDispatcher(['a', 'b'])

    def queue(self, kind: str, stamp: int) -> None:
        self._dispatcher.queue_action(kind, stamp, lambda: self.append(f'{kind}{stamp}'))


@pytest.fixture
def acted() -> Acted:
    return Acted()


def test_in_order_nothing_waits(acted):
    for stamp in (1, 2):
        acted.queue('a', stamp)
        acted.queue('b', stamp)
        assert acted[-2:] == [f'a{stamp}', f'b{stamp}']


@pytest.mark.parametrize('arrival', [*permutations(['b1', 'a2', 'b2'])])
def test_any_order_of_arrival_gives_one_order_of_action(acted, arrival):
    acted.queue('a', 1)
    for kind, stamp in arrival:
        acted.queue(kind, int(stamp))
    assert acted == ['a1', 'b1', 'a2', 'b2']


def test_an_answer_before_its_question_waits_from_the_first_image_on(acted):
    acted.queue('b', 1)
    assert acted == []
    acted.queue('a', 1)
    assert acted == ['a1', 'b1']


def test_what_never_comes_holds_up_no_more_than_one_image(acted):
    acted.queue('a', 1)
    acted.queue('a', 2)
    assert acted == ['a1'], 'b1 may still come'
    acted.queue('a', 3)
    assert acted == ['a1', 'a2']
    acted.queue('b', 1)
    assert acted == ['a1', 'a2', 'b1'], 'late, but not lost'
    acted.queue('b', 2)
    assert acted[3:] == ['b2', 'a3']


def test_an_answer_whose_question_never_comes_holds_up_nothing(acted):
    for kind, stamp in (('a', 1), ('b', 1), ('b', 2), ('a', 3), ('b', 3)):
        acted.queue(kind, stamp)
    assert acted == ['a1', 'b1', 'a3', 'b2', 'b3']


def test_an_image_that_is_sent_again_waits_no_longer(acted):
    acted.queue('a', 1)
    acted.queue('a', 2)
    acted.queue('a', 2)
    assert acted == ['a1', 'a2']


def test_an_image_that_is_answered_again_acts_again(acted):
    for kind in 'abab':
        acted.queue(kind, 1)
    assert acted == ['a1', 'b1', 'a1', 'b1']


def test_a_clock_that_is_set_back_starts_again(acted):
    for kind, stamp in (('a', 8), ('b', 8), ('a', 9), ('a', 1), ('b', 1), ('a', 2)):
        acted.queue(kind, stamp)
    assert acted == ['a8', 'b8', 'a9', 'a1', 'b1', 'a2']
