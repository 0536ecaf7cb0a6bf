"""Numbers that last and a target that does not flicker."""

import numpy as np
import pytest

from ja_common.core.geometry import vectors_of_directions
from ja_perception.core.object_tracking import ObjectTracker, TrackingConfig

SECOND = 1_000_000_000


@pytest.fixture
def tracker():
    return ObjectTracker(TrackingConfig(same_object_within_rad=0.05, hysteresis=0.2))


def numbers(tracker, directions, stamp_ns):
    return tracker.update(vectors_of_directions(np.reshape(directions, (-1, 2))), stamp_ns)


def test_numbers_follow_the_objects_in_any_order(tracker):
    assert numbers(tracker, [(0.0, 0.0), (0.3, 0.1)], 0) == [0, 1]
    assert numbers(tracker, [(0.31, 0.1), (0.01, 0.0)], SECOND) == [1, 0]


def test_each_number_is_given_once(tracker):
    numbers(tracker, [(0.0, 0.0)], 0)
    assert numbers(tracker, [(0.02, 0.0), (0.01, 0.0)], SECOND) == [1, 0]


def test_how_far_away_an_object_is_makes_no_difference(tracker):
    near = np.array([[1.0, 0.2, 0.1], [1.0, -0.2, 0.0]])
    assert tracker.update(near, 0) == tracker.update(5 * near, SECOND) == [0, 1]


def test_unseen_object_keeps_its_number_for_a_while_only(tracker):
    numbers(tracker, [(0.0, 0.0)], 0)
    assert numbers(tracker, [], SECOND) == []
    assert numbers(tracker, [(0.0, 0.0)], 2 * SECOND) == [0]
    assert numbers(tracker, [(0.0, 0.0)], 5 * SECOND) == [1]


def test_clock_set_back_starts_new_numbers(tracker):
    numbers(tracker, [(0.0, 0.0)], 100 * SECOND)
    assert numbers(tracker, [(0.0, 0.0)], SECOND) == [1]


def test_target_is_held_between_equals_but_yields_to_the_clearly_better(tracker):
    assert tracker.apply_hysteresis([0, 1], [0.50, 0.49], 0) == [0.50, 0.49]
    held = tracker.apply_hysteresis([0, 1], [0.49, 0.52], SECOND)
    assert held[0] > held[1]
    held = tracker.apply_hysteresis([0, 1], [0.49, 0.60], SECOND)
    assert held[1] > held[0]
    held = tracker.apply_hysteresis([0, 1], [0.52, 0.50], SECOND)
    assert held[1] > held[0]
