"""Faces over time, with a scripted finder."""

import numpy as np
import pytest

from ja_common.core.camera_model import CameraModel
from ja_common.core.geometry import rays_of_directions
from ja_perception.core.box import Box
from ja_perception.core.face_tracking import FaceConfig, FaceTracker, scan_squares, search_square
from ja_perception.core.faces import Face

CAMERA = CameraModel.from_field_of_view(160, 120, np.radians(36))
STEP_NS = 100_000_000


class Person:
    """A face at a direction [rad] with a width [px]."""

    def __init__(self, pan=0.0, tilt=0.0, width=30.0, score=0.9):
        self.direction, self.width, self.score = np.array([pan, tilt]), width, score


class World:
    """People seen from a turning head; also a FaceFinder that finds them in its squares."""

    smallest_share = 0.2

    def __init__(self, *people, **config):
        self.people = list(people)
        self.tracker = FaceTracker(self, FaceConfig(**config))
        self.posture = np.zeros(2)
        self.now_ns = 0
        self.squares = []
        self.rng = np.random.default_rng(0)

    def find_faces(self, image, square):
        self.squares.append(square)
        faces = []
        for person in self.people:
            u, v = CAMERA.pixels(rays_of_directions(self.posture, person.direction))
            inside = max(abs(u - square.u), abs(v - square.v)) < square.width / 2
            if inside and CAMERA.contains((u, v)):
                box = Box(float(u), float(v), person.width, person.width)
                faces.append(Face(box, person.score, np.empty((0, 2))))
        return faces

    def observe(self, pan=0.0, changed=True):
        """Show the tracker the next image; noise changes every one."""
        self.posture = np.array([pan, 0.0])
        self.now_ns += STEP_NS
        self.squares.clear()
        shape = (120, 160)
        grey = self.rng.integers(0, 256, shape, np.uint8) if changed else np.zeros(shape, np.uint8)
        image = np.dstack([grey] * 3)
        return self.tracker.update(image, grey, CAMERA, self.posture, self.now_ns)


def test_face_keeps_its_number_while_the_head_turns():
    world = World(Person(pan=0.1))
    (first,) = world.observe(0.0)
    (again,) = world.observe(0.25)
    assert again.track_id == first.track_id
    u = CAMERA.pixels(rays_of_directions((0.25, 0), (0.1, 0)))[0]
    assert again.box(CAMERA, np.array([0.25, 0])).u == pytest.approx(u, abs=0.01)


def test_out_of_view_the_caregiver_is_remembered_and_not_reported():
    world = World(Person())
    (first,) = world.observe(0.0)
    for _ in range(100):
        assert world.observe(1.0) == []
    (again,) = world.observe(0.0)
    assert again.track_id == first.track_id


def test_caregiver_is_the_largest_at_first_and_then_stays_it():
    near, far = Person(-0.15, width=30), Person(0.15, width=22)
    world = World(far, near)
    caregiver = world.observe()[0]
    assert caregiver.box(CAMERA, world.posture).width == pytest.approx(30)
    far.width = 45
    faces = world.observe()
    assert faces[0].track_id == caregiver.track_id
    assert len(faces) == 2


def test_missed_for_a_moment_she_is_held_then_not_reported_then_forgotten():
    world = World(Person(), hold_face_s=0.25, forget_face_s=0.85)
    (first,) = world.observe()
    (person,) = world.people
    world.people.clear()
    counts = [len(world.observe()) for _ in range(8)]
    assert counts == [1, 1, 0, 0, 0, 0, 0, 0]
    world.people.append(person)
    (again,) = world.observe()
    assert again.track_id == first.track_id
    world.people.clear()
    for _ in range(9):
        world.observe()
    world.people.append(person)
    (stranger,) = world.observe()
    assert stranger.track_id != first.track_id


def test_jitter_is_averaged_and_a_turn_is_followed_at_once():
    person = Person()
    world = World(person, face_averaging=20)
    rng = np.random.default_rng(1)
    places = []
    for _ in range(60):
        person.direction = rng.normal(0, 0.001, 2)
        (face,) = world.observe()
        places.append(face.box(CAMERA, world.posture).u)
    jitter_px = 0.001 * CAMERA.fx
    assert np.std(np.diff(places[20:])) < 0.2 * jitter_px
    person.direction = np.array([0.03, 0.0])
    (face,) = world.observe()
    expected = CAMERA.pixels(rays_of_directions((0, 0), person.direction))[0]
    assert face.box(CAMERA, world.posture).u == pytest.approx(expected, abs=0.01)


def test_new_face_needs_confidence_but_a_known_one_may_turn_away():
    person = Person(score=0.6)
    world = World(person)
    assert world.observe() == []
    person.score = 0.8
    assert len(world.observe()) == 1
    person.score = 0.5
    assert len(world.observe()) == 1


def test_who_moved_while_out_of_view_is_searched_for_in_every_image():
    person = Person()
    world = World(person, scan_every=1000, hold_face_s=0.15)
    world.observe()
    person.direction = np.array([0.2, 0.0])
    found_after = next(k for k in range(1, 10) if any(f.missed_s == 0 for f in world.observe()))
    assert found_after == 2


def test_unchanged_face_costs_no_look():
    world = World(Person(), scan_every=1000)
    world.observe(changed=False)
    assert len(world.observe(changed=False)) == 1
    assert world.squares == []
    world.observe(changed=True)
    assert len(world.squares) == 1


def test_a_scan_waits_for_an_image_in_which_her_face_needs_no_look():
    world = World(Person(), scan_every=5)
    world.observe()
    looks = [len(world.squares) for _ in range(40) if world.observe()]
    # She is looked at in every image; the scan comes all the same, every tenth.
    assert looks == ([1] * 9 + [2]) * 4
    world.observe(changed=False)  # remembers the picture that stays the same from here on
    looks = [len(world.squares) for _ in range(20) if world.observe(changed=False)]
    assert max(looks) == 1
    assert sum(looks) == 4


def test_clock_set_back_forgets():
    world = World(Person())
    (first,) = world.observe()
    world.now_ns = -10 * STEP_NS
    (again,) = world.observe()
    assert again.track_id != first.track_id


def test_scan_goes_round_and_covers_every_place_with_small_squares():
    squares = scan_squares(640, 480, 200)
    assert squares[0] == Box(319.5, 239.5, 640, 640)
    smallest = min(square.width for square in squares)
    assert 200 <= smallest < 334
    small = [s for s in squares if s.width == smallest]
    face = 40
    for u in range(face // 2, 640 - face // 2, 10):
        for v in range(face // 2, 480 - face // 2, 10):
            margin = smallest / 2 - face / 2
            assert any(abs(s.u - u) <= margin and abs(s.v - v) <= margin for s in small), (u, v)


def test_look_at_a_large_face_takes_the_whole_picture():
    whole = Box(79.5, 59.5, 160, 160)
    assert search_square(Box(80, 60, 60, 60), whole) is whole
    assert search_square(Box(80, 60, 20, 20), whole) == Box(80, 60, 50, 50)
