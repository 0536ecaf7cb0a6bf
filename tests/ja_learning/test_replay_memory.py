"""The ring of remembered trials."""

import numpy as np
import pytest

from ja_learning.core.gaze_line_places import IN_VIEW, PLACE_COLUMNS
from ja_learning.core.replay_memory import MOST_CANDIDATES, ReplayMemory
from ja_learning.core.trial import FACE_SHAPE, FaceFormat


def rows(in_view: np.ndarray) -> np.ndarray:
    """Make places (m, 8) of which no distance is known."""
    places = np.full((len(in_view), PLACE_COLUMNS), np.nan)
    places[:, IN_VIEW] = in_view
    return places


def filled(trials: int, capacity: int) -> ReplayMemory:
    memory = ReplayMemory(capacity)
    for trial in range(trials):
        memory.remember_trial(
            np.full(FACE_SHAPE, trial % 256, np.uint8), rows(np.full((1 + trial % 3, 2), trial))
        )
    return memory


@pytest.mark.parametrize(
    ('trials', 'capacity'), [(1, 5), (5, 5), (12, 5), (200, 1000), (300, 150)]
)
def test_the_newest_are_kept_and_found_by_age(trials, capacity):
    memory = filled(trials, capacity)
    kept = min(trials, capacity)
    assert len(memory) == kept
    ages = np.arange(kept)
    faces, places = memory.trials_at(ages)
    newest_first = trials - 1 - ages
    assert np.array_equal(faces[:, 0, 0], newest_first % 256)
    assert np.array_equal(places[:, 0, 0], newest_first)
    assert np.array_equal(memory.counts(kept), 1 + newest_first % 3)


def test_places_are_padded_as_wide_as_needed():
    memory = filled(3, 10)
    assert memory.trials_at(np.array([2]))[1].shape == (1, 1, PLACE_COLUMNS)
    places = memory.trials_at(np.array([[0, 2], [1, 0]]))[1]
    assert places.shape == (2, 2, 3, PLACE_COLUMNS)
    assert np.isnan(places[0, 1, 1:]).all()


def test_of_each_trial_one_of_the_places_seen_is_found():
    memory = ReplayMemory(4)
    for trial in range(5):
        places = np.array([[trial, place] for place in range(1 + trial)])
        memory.remember_trial(np.zeros(FACE_SHAPE, np.uint8), rows(places))
    ages, which = np.array([[0, 1], [2, 3]]), np.array([[0.99, 0.0], [0.4, 0.5]])
    found = memory.places_at(ages, which)[..., IN_VIEW]
    assert found.tolist() == [[[4, 4], [3, 0]], [[2, 1], [1, 1]]]


def test_too_many_candidates_are_cut():
    memory = ReplayMemory(4)
    memory.remember_trial(np.zeros(FACE_SHAPE, np.uint8), rows(np.zeros((MOST_CANDIDATES + 5, 2))))
    assert memory.counts(1) == [MOST_CANDIDATES]


def test_what_came_before_a_change_can_be_forgotten():
    memory = filled(30, 100)
    memory.keep_newest(4)
    assert len(memory) == 4
    memory.remember_trial(np.zeros(FACE_SHAPE, np.uint8), rows(np.full((1, 2), 99.0)))
    assert np.array_equal(memory.trials_at(np.arange(5))[1][:, 0, 0], [99, 29, 28, 27, 26])


@pytest.mark.parametrize('trials', [0, 3, 12])
def test_a_restored_memory_is_the_same(trials):
    memory = filled(trials, 8)
    again = ReplayMemory.restored(memory.state(), 8)
    one, other = memory.state(), again.state()
    assert all(np.array_equal(one[name], other[name]) for name in one)
    assert len(again) == min(trials, 8)


def test_ranges_and_readings_come_back_from_the_state():
    form = FaceFormat((6,), np.float32)
    memory = ReplayMemory(4, form)
    places = rows(np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]]))
    places[1, 2:] = np.arange(6)
    memory.remember_trial(np.linspace(-1, 1, 6).astype(np.float32), places)
    memory.remember_trial(np.zeros(6, np.float32), rows(np.zeros((1, 2))))
    state = memory.state()
    assert all(not np.isnan(array).any() for array in state.values()), 'a checkpoint has no NaN'
    again = ReplayMemory.restored(state, 4, form)
    for before, after in zip(
        memory.trials_at(np.arange(2)), again.trials_at(np.arange(2)), strict=True
    ):
        np.testing.assert_array_equal(before, after)
    with pytest.raises(ValueError, match='faces'):
        ReplayMemory.restored(state, 4)
    with pytest.raises(ValueError, match='below'):
        ReplayMemory.restored(state | {'candidates_with_range': np.array([9])}, 4, form)
