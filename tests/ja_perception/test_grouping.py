"""From coloured pixels to objects."""

import numpy as np
import pytest

from ja_perception.core.box import Box
from ja_perception.core.features import FeatureConfig, colour_map
from ja_perception.core.grouping import Grouping, GroupingConfig, Region, merge_regions
from synthetic_pictures import draw_ball, room

RED, ORANGE, GREEN, BLUE = (220, 30, 30), (230, 130, 20), (30, 200, 40), (30, 60, 220)
GROUPING = Grouping(GroupingConfig())


def regions_in(picture):
    found = GROUPING.group_by_colour(colour_map(picture, FeatureConfig()))
    return sorted(found, key=lambda region: region.box.u)


def places(regions):
    return [(region.box.u, region.box.v) for region in regions]


def test_balls_apart_are_objects_at_their_places_with_their_areas():
    picture = room(160, 120)
    draw_ball(picture, 30, 40, 8, RED)
    draw_ball(picture, 120, 80, 12, BLUE)
    small, large = regions_in(picture)
    assert places([small, large]) == [pytest.approx((30, 40)), pytest.approx((120, 80))]
    assert small.bright_px == pytest.approx(np.pi * 8**2, rel=0.15)
    assert large.bright_px == pytest.approx(np.pi * 12**2, rel=0.15)


@pytest.mark.parametrize('colours', [(RED, GREEN), (GREEN, BLUE), (ORANGE, BLUE), (RED, BLUE)])
def test_touching_objects_of_different_hue_are_separated(colours):
    picture = room(160, 120)
    draw_ball(picture, 70, 60, 12, colours[0])
    draw_ball(picture, 91, 60, 12, colours[1])
    regions = regions_in(picture)
    assert places(regions) == [pytest.approx((70, 60), abs=2), pytest.approx((91, 60), abs=2)]


def test_red_on_both_sides_of_hue_zero_is_one_colour():
    picture = room(160, 120)
    picture[50:70, 60:75] = (220, 30, 45)
    picture[50:70, 75:90] = (220, 45, 30)
    assert len(regions_in(picture)) == 1


def test_stripes_are_one_object():
    picture = room(160, 120)
    for row in range(40, 80, 8):
        picture[row : row + 4, 60:100] = RED
        picture[row + 4 : row + 8, 60:100] = GREEN
    assert len(regions_in(picture)) == 1


def test_background_and_specks_are_no_objects():
    picture = room(160, 120)
    picture[90:] = GREEN  # a meadow from guard to guard
    picture[10, 20] = RED
    assert regions_in(picture) == []
    picture[:] = BLUE
    assert regions_in(picture) == []


def test_texture_stands_out_from_a_plain_wall():
    edges = np.zeros((120, 160), np.uint8)
    edges[40:70:2, 60:100] = 1
    (region,) = GROUPING.group_by_texture(edges)
    assert region.box.overlap(Box(79.5, 54.5, 40, 30)) > 0.95
    assert GROUPING.group_by_texture(np.zeros_like(edges)) == []


def test_rims_of_a_mover_are_one_object():
    moving = np.zeros((120, 160), np.uint8)
    moving[50:60, 70:73] = moving[50:60, 76:79] = 1
    (region,) = GROUPING.group_by_motion(moving)
    assert (region.box.u, region.box.width) == (74, 9)


def test_what_overlaps_is_one_object_and_the_first_detector_names_it():
    ball = Region(Box(50, 50, 20, 20), 300)
    its_motion = Region(Box(52, 50, 30, 24))
    other = Region(Box(120, 50, 10, 10))
    assert merge_regions([ball], [its_motion, other]) == [ball, other]
