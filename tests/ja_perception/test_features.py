"""Maps of bright colour, edges and motion of small pictures made by hand."""

import numpy as np
import pytest

from ja_perception.core.features import (
    FeatureConfig,
    colour_map,
    edge_map,
    motion_map,
    remove_specks,
)

CONFIG = FeatureConfig()


@pytest.mark.parametrize(
    ('rgb', 'bright', 'hue'),
    [
        ((220, 30, 30), 1, 0),
        ((30, 220, 30), 1, 60),
        ((30, 30, 220), 1, 120),
        ((128, 128, 128), 0, None),  # grey
        ((40, 5, 5), 0, None),  # saturated but dark
        ((224, 180, 150), 0, None),  # fair skin
        ((120, 85, 65), 0, None),  # dark skin
    ],
)
def test_bright_colours(rgb, bright, hue):
    colour = colour_map(np.full((4, 4, 3), rgb, np.uint8), CONFIG)
    assert np.all(colour.bright == bright)
    if hue is not None:
        assert np.all(colour.hue == hue)


def test_edges_stand_where_brightness_steps():
    grey = np.zeros((6, 8), np.uint8)
    grey[:, 4:] = 100
    expected = np.zeros_like(grey)
    expected[:, 4] = 1
    assert np.array_equal(edge_map(grey, CONFIG), expected)
    assert np.array_equal(edge_map(grey.T.copy(), CONFIG), expected.T)
    assert not edge_map((grey * 0.2).astype(np.uint8), CONFIG).any()


def checkers(shift=0):
    rows, columns = np.indices((40, 60))
    return np.where((rows // 8 + (columns + shift) // 8) % 2, 180, 60).astype(np.uint8)


def test_motion_forgives_a_pixel_and_a_change_of_light_but_not_a_mover():
    assert not motion_map(checkers(1), checkers(), CONFIG).any()
    assert not motion_map(checkers() + np.uint8(50), checkers(), CONFIG).any()
    assert not motion_map(checkers() - np.uint8(50), checkers(), CONFIG).any()
    moved = checkers()
    moved[10:22, 20:32] = 255
    moving = motion_map(moved, checkers(), CONFIG)
    assert moving[12:20, 22:30].mean() > 0.9
    assert moving[:, 40:].sum() == 0


def test_nothing_moves_where_nothing_was_in_view_before():
    expected = checkers()
    expected[:, 30:] = 0
    moved = checkers()
    moved[:, 10:25] = moved[:, 35:] = 255
    moving = motion_map(moved, expected, CONFIG)
    assert moving[:, 12:23].any()
    assert moving[:, 30:].sum() == 0
    assert not motion_map(255 - checkers(), 0 * expected, CONFIG).any()


def test_specks_go_and_the_rest_stays_in_place():
    mask = np.zeros((12, 12), np.uint8)
    mask[2:6, 3:9] = 1
    clean = mask.copy()
    mask[9, 2] = mask[10, 5:10] = 1
    assert np.array_equal(remove_specks(mask), clean)
