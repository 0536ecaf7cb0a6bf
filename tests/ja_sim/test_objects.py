"""Where objects are drawn, and what happens to them when the scene is rearranged."""

import numpy as np
import pytest

from ja_common.core.config import ConfigError
from ja_common.core.geometry import angle_between, directions_of_vectors
from ja_sim.core.objects import MOTION_RADIUS_M, Arrangement
from ja_sim.core.specs import ObjectsSpec

FACE = np.array([1.2, 0.0, 0.0])


def arrangement(seed: int = 0, **settings) -> Arrangement:
    return Arrangement(ObjectsSpec(**settings), FACE, np.random.default_rng(seed))


def positions(arranged: Arrangement) -> np.ndarray:
    return np.array([thing.position for thing in arranged.objects])


@pytest.mark.parametrize('count', [1, 5, 10])
def test_objects_are_drawn_where_the_scene_allows(count):
    arranged = arrangement(count=count)
    for _ in range(50):
        arranged.rearrange()
        places = positions(arranged)
        directions = directions_of_vectors(places)
        distance = np.linalg.norm(places, axis=1)
        assert places.shape == (count, 3)
        assert np.all(np.abs(np.degrees(directions)) <= [40.0, 15.0])
        assert np.all((distance >= 0.6) & (distance <= 1.0))
        assert np.degrees(angle_between(directions, [0.0, 0.0])).min() >= 8.0
        gaps = np.degrees(angle_between(directions[:, None], directions))
        assert gaps[~np.eye(count, dtype=bool)].min(initial=90.0) >= 5.0


def test_the_whole_space_is_used():
    arranged = arrangement(count=10)
    drawn = []
    for _ in range(100):
        arranged.rearrange()
        drawn.append(positions(arranged))
    drawn = np.concatenate(drawn)
    directions = np.degrees(directions_of_vectors(drawn))
    assert np.all(directions.min(axis=0) < [-38.0, -14.0])
    assert np.all(directions.max(axis=0) > [38.0, 14.0])
    assert np.ptp(np.linalg.norm(drawn, axis=1)) > 0.38


def test_too_many_objects_for_the_space_are_refused():
    with pytest.raises(ConfigError, match='no room for 10 objects'):
        arrangement(count=10, pan_deg=(-15.0, 15.0), tilt_deg=(-2.0, 2.0), gap_deg=8.0)


def test_replaced_objects_are_new_ones():
    arranged = arrangement(rearranged='replaced')
    before = arranged.objects
    arranged.rearrange()
    assert not {t.identifier for t in before} & {t.identifier for t in arranged.objects}


def test_moved_objects_keep_their_looks():
    arranged = arrangement(rearranged='moved')
    before, places = arranged.objects, positions(arranged)
    arranged.rearrange()
    assert [t.identifier for t in before] == [t.identifier for t in arranged.objects]
    assert [t.colour for t in before] == [t.colour for t in arranged.objects]
    assert np.abs(positions(arranged) - places).min() > 0.0


def test_objects_that_stay_stay():
    arranged = arrangement(rearranged='never')
    before = arranged.objects
    arranged.rearrange()
    assert arranged.objects is before


def test_colours_are_bright_and_all_different():
    for seed in range(20):
        colours = np.array([t.colour for t in arrangement(seed, count=10).objects])
        saturation = 1.0 - colours.min(axis=1) / colours.max(axis=1)
        assert saturation.min() >= 0.8
        difference = np.abs(colours[:, None] - colours).sum(axis=2)
        assert difference[~np.eye(10, dtype=bool)].min() > 0.1


def test_moving_objects_circle_around_their_place():
    thing = arrangement(count=1, moving_share=1.0).objects[0]
    path = np.array([thing.position_at(t) for t in np.arange(0.0, 5.0, 0.05)])
    off = np.linalg.norm(path - thing.position, axis=1)
    np.testing.assert_allclose(off, MOTION_RADIUS_M)
    assert np.ptp(path, axis=0)[1:].min() > MOTION_RADIUS_M
    still = arrangement(count=1, moving_share=0.0).objects[0]
    np.testing.assert_array_equal(still.position_at(3.0), still.position)
    assert np.linalg.norm(still.position_at(3.0, shaken=True) - still.position) > 0.01
