"""The numbers of the things stay while the head looks about, and start again when it must be."""

import numpy as np
import pytest

from ja_caregiver.core.numbered_things import (
    NumberedThings,
    NumberedThingsConfig,
    nearest_thing,
)
from ja_common.core.geometry import rays_of_directions
from ja_common.core.posture import Posture

HALF_VIEW = (0.31, 0.24)
PERIOD_NS = 66_000_000
LEFT, MIDDLE, RIGHT = (0.5, 0.1), (0.1, 0.12), (-0.4, 0.1)


class Head:
    """A head that sees the things in its view, image after image."""

    def __init__(self, *things, noise=0.004, **config):
        self.numbered = NumberedThings(NumberedThingsConfig(**config), HALF_VIEW)
        self.things = [np.array(thing) for thing in things]
        self.stamp_ns = 10**9
        self.random = np.random.default_rng(3)
        self.noise = noise

    def look(self, pan=0.0, tilt=0.0, images=12, speed=0.0, extra=()):
        """Take images at a posture; return the numbered things."""
        for _ in range(images):
            self.stamp_ns += PERIOD_NS
            posture = np.array([pan, tilt])
            seen = [
                thing + self.random.normal(0.0, self.noise, 2)
                for thing in self.things
                if (np.abs(rays_of_directions(posture, thing)) < np.tan(HALF_VIEW)).all()
            ]
            self.random.shuffle(seen)
            velocity = np.array([speed, 0.0])
            self.numbered.observe_image(Posture(self.stamp_ns, posture, velocity), [*seen, *extra])
        return self.numbered.directions


def number_at(things, place, within=0.05):
    [number] = [n for n, at in things.items() if np.hypot(*np.subtract(at, place)) < within]
    return number


def test_numbers_are_given_from_left_to_right_and_stay_while_the_head_turns():
    head = Head(LEFT, MIDDLE, RIGHT)
    first = head.look(pan=0.2)
    assert (number_at(first, LEFT), number_at(first, MIDDLE)) == (1, 2)
    second = head.look(pan=-0.3)
    assert number_at(second, RIGHT) == 3
    for pan in (0.2, -0.3, 0.6, 0.0):
        things = head.look(pan=pan)
        assert [number_at(things, each) for each in (LEFT, MIDDLE, RIGHT)] == [1, 2, 3]


def test_a_thing_seen_from_two_postures_needs_no_long_look():
    """As in two short glances to a side."""
    head = Head(LEFT)
    assert head.look(pan=0.4, images=1) == {}
    head.look(pan=-0.6, images=1)
    assert number_at(head.look(pan=0.45, images=1), LEFT) == 1


def test_what_is_seen_for_a_moment_gets_no_number():
    head = Head(MIDDLE)
    hand = np.array([-0.2, 0.05])
    assert len(head.look(images=4, extra=[hand])) == 0
    assert len(head.look(images=30)) == 1
    # Its place was in view without it: that it comes again is a first time.
    assert len(head.look(images=4, extra=[hand])) == 1


def test_a_head_that_turns_shows_nothing():
    head = Head(MIDDLE)
    assert head.look(images=40, speed=0.5) == {}


def test_a_thing_that_is_taken_away_disappears_only_where_it_is_in_view():
    head = Head(LEFT, RIGHT)
    head.look(pan=0.3), head.look(pan=-0.3)
    del head.things[0]
    assert set(head.look(pan=-0.3, images=200)) == {1, 2}  # out of view: it may still be there
    assert set(head.look(pan=0.3, images=30)) == {1, 2}  # not yet
    assert set(head.look(pan=0.3, images=30)) == {2}


def test_a_thing_covered_for_a_moment_keeps_its_number():
    head = Head(MIDDLE)
    head.look()
    kept, head.things = head.things, []
    head.look(images=20)
    head.things = kept
    assert list(head.look()) == [1]


@pytest.mark.parametrize(('speed', 'number'), [(0.3, 1), (2.5, 3)])
def test_a_thing_moved_in_view_keeps_its_number_if_it_is_slow(speed, number):
    head = Head((0.1, 0.2), (-0.1, 0.1), noise=0.0)
    head.look()
    while head.things[0][0] > -0.22:
        head.things[0] = head.things[0] - [speed * PERIOD_NS / 1e9, 0.0]
        head.look(images=1)
    things = head.look(images=60)
    assert number_at(things, head.things[0]) == number
    assert number_at(things, (-0.1, 0.1)) == 2


def test_two_things_close_to_each_other_are_two():
    head = Head((0.0, 0.1), (0.06, 0.1), noise=0.002)
    for _ in range(5):
        things = head.look(images=20)
        assert number_at(things, (0.06, 0.1), 0.02) == 1
        assert number_at(things, (0.0, 0.1), 0.02) == 2


def test_numbers_are_never_used_again_until_things_are_rearranged():
    head = Head(MIDDLE, (-0.3, 0.1))
    head.look(pan=-0.1)
    head.things = [np.array((-0.1, 0.0))]
    assert list(head.look(pan=-0.1, images=100)) == [3]
    head.numbered.restart()
    assert head.numbered.directions == {}
    assert list(head.look(pan=-0.1)) == [1]


def test_a_clock_set_back_and_a_thousand_objects_do_no_harm():
    head = Head(MIDDLE)
    head.look()
    head.stamp_ns -= 10**12
    assert list(head.look()) == [1]
    many = np.random.default_rng(0).uniform(-0.3, 0.3, (1000, 2))
    head.look(images=3, extra=many)
    assert 1 in head.numbered.directions
    assert len(head.numbered.directions) <= 100


def test_nothing_is_seen():
    head = Head()
    assert head.look(images=40) == {}


def test_the_nearest_thing():
    things = {2: (0.0, 0.0), 5: (0.3, 0.1)}
    assert nearest_thing(things, (0.25, 0.0)) == 5
    assert nearest_thing(things, (0.25, 0.0), within_rad=0.05) is None
    assert nearest_thing({}, (0.0, 0.0)) is None
