"""The film of a rehearsal: she looks where the schedule states, and things move between."""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from ja_caregiver.core.film_clips import directions_of_places
from ja_caregiver.core.rehearsal import Rehearsal, RehearsalConfig, film_rehearsal
from ja_caregiver.core.schedule import Rearrangement, make_schedule
from ja_caregiver.core.thing_places import PlacedThings, draw_places, place_things
from ja_common.core.config import ConfigError
from ja_common.core.files import SaveError

SMALL = RehearsalConfig(width=320, height=180, rate_hz=5.0)
PLAN = make_schedule(2, 4, 3, pace=2.0, rearrange_every=2, rearrange_s=1.0)


@pytest.fixture(scope='module')
def filmed(tmp_path_factory):
    """Make a short film; return it, its schedule with places, and its pictures (RGB)."""
    path = tmp_path_factory.mktemp('rehearsal') / 'film.avi'
    shares: list[float] = []
    schedule = film_rehearsal(PLAN, path, SMALL, shares.append)
    assert shares[-1] == pytest.approx(1.0)
    capture = cv2.VideoCapture(str(path))
    pictures = []
    while (got := capture.read())[0]:
        pictures.append(cv2.cvtColor(got[1], cv2.COLOR_BGR2RGB))
    return path, schedule, pictures


def test_the_schedule_stays_and_gets_places(filmed):
    _, schedule, pictures = filmed
    assert [each.end_s for each in schedule.segments] == [each.end_s for each in PLAN.segments]
    assert [look.thing for look in schedule.looks] == [look.thing for look in PLAN.looks]
    assert all(len(look.things) == 3 for look in schedule.looks)
    assert all(look.things == tuple(sorted(look.things)) for look in schedule.looks), 'from left'
    assert schedule.view_deg == SMALL.view_deg
    assert len(pictures) == math.ceil((PLAN.end_s + 1) * SMALL.rate_hz)


def test_things_move_where_the_schedule_states(filmed):
    places = [look.things for look in filmed[1].looks]
    assert places[0] == places[1] != places[2] == places[3]
    assert isinstance(PLAN.segments[2], Rearrangement)


def test_the_simulated_person_looks_at_the_thing_when_asked():
    rehearsal = Rehearsal(PLAN, SMALL)
    size, view = (SMALL.width, SMALL.height), math.radians(SMALL.view_deg)
    attended, towards_camera = {}, {}
    for number, _ in enumerate(rehearsal.pictures(), 1):
        time_s = number / SMALL.rate_hz
        truth = rehearsal._world.truth()
        for index, look in enumerate(PLAN.looks):
            if look.start_s + 0.7 < time_s < look.end_s:
                attended[index] = truth.directions[truth.attended].copy()
            if look.camera_s + 0.55 < time_s <= look.start_s:
                towards_camera[index] = np.abs(truth.gaze_target).max()
    rehearsal.close()
    for index, look in enumerate(rehearsal.schedule().looks):
        wanted = directions_of_places(look.things, size, view)[look.thing - 1]
        assert attended[index] == pytest.approx(wanted, abs=1e-6)
        assert towards_camera[index] == 0.0


def test_the_same_seed_films_the_same(tmp_path: Path, filmed):
    path, schedule, _ = filmed
    again = film_rehearsal(PLAN, tmp_path / 'again.avi', SMALL)
    assert again == schedule
    assert (tmp_path / 'again.avi').read_bytes() == path.read_bytes()


def test_the_robots_own_detector_finds_the_things(filmed):
    _, schedule, pictures = filmed

    def picture_at(time_s):
        index = round((time_s + schedule.offset_s) * SMALL.rate_hz)
        return pictures[index] if index < len(pictures) else None

    placed, found = place_things(PLAN, picture_at, math.radians(SMALL.view_deg))
    assert len(found) == 2
    for ours, true in zip(placed.looks, schedule.looks, strict=True):
        assert np.array(ours.things) == pytest.approx(np.array(true.things), abs=0.03)
    assert place_things(schedule, picture_at, 1.0) == (schedule, []), 'what is known stays'


def test_too_few_things_are_reported():
    empty = np.full((180, 320, 3), 128, np.uint8)
    with pytest.raises(ConfigError, match=r'only 0 of 3 things are found in the film at 5\.0 s'):
        place_things(PLAN, lambda _: empty, 1.2)


def test_what_the_film_does_not_show_stays_without_places():
    placed, found = place_things(PLAN, lambda _: None, 1.2)
    assert (placed, found) == (PLAN, [])


def test_numbers_are_drawn_at_the_places():
    dark = np.zeros((90, 160, 3), np.uint8)
    drawn = draw_places(PlacedThings(0.0, ((0.25, 0.5), (0.75, 0.5)), dark))
    assert drawn[:, :80].any()
    assert drawn[:, 80:].any()
    assert not dark.any()


def test_another_ending_and_an_unwritable_place_are_refused(tmp_path: Path):
    with pytest.raises(ConfigError, match=r'ends in \.mp4 or \.avi'):
        film_rehearsal(PLAN, tmp_path / 'film.gif', SMALL)
    (tmp_path / 'file').touch()
    with pytest.raises(SaveError):
        film_rehearsal(PLAN, tmp_path / 'file' / 'film.mp4', SMALL)
    assert not list(tmp_path.glob('.*'))


def test_too_many_things_for_the_picture_are_refused():
    with pytest.raises(ConfigError):
        Rehearsal(make_schedule(0, 2, 12), SMALL)
