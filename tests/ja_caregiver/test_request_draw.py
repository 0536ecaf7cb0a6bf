"""The order of the requests: balanced, repeatable, and never known from the last ones."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from ja_caregiver.core.request_draw import RequestDraw


def test_each_thing_is_asked_for_about_equally_often():
    draw = RequestDraw(1)
    counts = Counter(draw.draw([1, 2, 3, 4, 5]) for _ in range(100))
    assert set(counts) == {1, 2, 3, 4, 5}
    assert max(counts.values()) - min(counts.values()) <= 5


def test_every_thing_may_follow_every_thing_itself_too():
    draw = RequestDraw(2)
    order = [draw.draw([1, 2, 3]) for _ in range(2000)]
    pairs = Counter(pairwise(order))
    assert len(pairs) == 9
    assert min(pairs.values()) > 100
    assert max(pairs.values()) < 400


def test_the_same_seed_gives_the_same_order_and_another_one_another():
    orders = [
        [RequestDraw(seed, done).draw([1, 2, 3, 4]) for done in range(30)] for seed in (4, 4, 5)
    ]
    assert orders[0] == orders[1] != orders[2]


def test_the_order_does_not_follow_from_what_the_robot_draws():
    """The gate and the learner have the same seed."""
    draw, robot = RequestDraw(0), np.random.default_rng(0)
    ours = [draw.draw([1, 2, 3, 4]) for _ in range(200)]
    theirs = [int(robot.choice([1, 2, 3, 4])) for _ in range(200)]
    assert abs(np.mean(np.equal(ours, theirs)) - 0.25) < 0.1


def test_a_thing_that_appears_late_need_not_catch_up():
    draw = RequestDraw(3)
    for _ in range(50):
        draw.draw([1, 2])
    late = [draw.draw([1, 2, 7]) for _ in range(30)]
    assert 5 <= late.count(7) <= 16
    assert late[:10].count(7) < 9


def test_after_a_rearrangement_counting_starts_again():
    draw = RequestDraw(3)
    for _ in range(50):
        draw.draw([1])
    draw.restart()
    order = [draw.draw([1, 2]) for _ in range(40)]
    assert 14 <= order.count(1) <= 26


def test_without_a_thing_there_is_nothing_to_draw():
    with pytest.raises(ValueError, match='no thing to ask for'):
        RequestDraw(0).draw([])
