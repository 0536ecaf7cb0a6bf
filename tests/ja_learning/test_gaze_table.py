"""The table of gazes equals the density that the belief evaluates."""

import numpy as np
import pytest

from ja_learning.core.gaze_line_belief import GazeLineBelief
from ja_learning.core.gaze_line_places import PLACE_COLUMNS, seen_places
from ja_learning.core.gaze_table import (
    LEVELS,
    PAN_MOST,
    SHAPE,
    STEP,
    TILT_MOST,
    gaze_table,
    level_mixture,
    look_up,
    look_up_place,
)
from ja_learning.core.trial import Look

LOOK = Look(np.zeros((30, 25), np.uint8), np.zeros(2), np.array([1.2, 0.02]))
DIRECTIONS = np.array([[0.3, 0.1], [-0.4, -0.05]])


@pytest.mark.parametrize('ranges', [None, np.array([[0.8, 0.02], [0.9, 0.03]])])
@pytest.mark.parametrize('level', range(len(LEVELS)))
def test_a_table_is_the_density_of_the_belief(level: int, ranges: np.ndarray | None):
    places = seen_places(LOOK, DIRECTIONS, ranges)
    table = gaze_table(places)
    assert table.shape == SHAPE
    for pan, tilt in [(0.6, 0.12), (-0.6, -0.06), (1.02, 0.3)]:
        gaze = np.array([[[pan, tilt]]])
        belief = GazeLineBelief(
            lambda look: look.face,
            lambda faces, gaze=gaze: gaze,
            level_mixture(np.array([level])),
            np.zeros(1),
            0.0,
            True,
            4.5,
        )
        coded = belief._code(LOOK)
        asked = np.exp(belief._mixed(coded, places)).sum()
        found = look_up(table.astype(float), level, pan, tilt)
        assert found == pytest.approx(asked, rel=2e-3, abs=1e-6)


def test_between_its_nodes_it_is_interpolated_and_beyond_it_stays():
    table = np.arange(np.prod(SHAPE), dtype=float).reshape(SHAPE)
    middle = look_up(table, 0, -PAN_MOST + 0.5 * STEP, -TILT_MOST + 0.5 * STEP)
    assert middle == pytest.approx(table[0, :2, :2].mean())
    assert look_up(table, 1, -9.0, -9.0) == table[1, 0, 0]
    assert look_up(table, 1, 9.0, 9.0) == pytest.approx(table[1, -1, -1], rel=1e-3)


@pytest.mark.parametrize('ranges', [None, np.array([[0.8, 0.02], [0.9, 0.03]])])
def test_a_place_alone_is_looked_up_as_in_its_table(ranges: np.ndarray | None):
    places = seen_places(LOOK, DIRECTIONS, ranges)
    gazes = np.random.default_rng(0).normal(size=(50, 2)) * [1.5, 0.8]  # some beyond the edges
    for place in places:
        table = gaze_table(place[None])
        for level in range(len(LEVELS)):
            for pan, tilt in gazes:
                assert look_up_place(place, level, pan, tilt) == look_up(table, level, pan, tilt)


def test_without_candidates_a_table_is_zero():
    assert not gaze_table(np.empty((0, PLACE_COLUMNS))).any()
