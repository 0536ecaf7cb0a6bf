"""A learner alone, on rendered looks: what the benchmarks of learning teach it and ask it.

Each trial has one look at the caregiver, and every object that was seen is a candidate. The other
objects are drawn beside the one that she attended to when the look was rendered. In the test the
learner chooses among the objects of looks that it never learned from.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ja_common.core.face_gaze import FaceGaze
from ja_experiments.datasets.looks import Looks, LooksOrder, load_looks
from ja_experiments.processes import run_in_processes
from ja_learning.core.learner import Learner, Predictor
from ja_learning.core.mean_face import MeanFaceTracker
from ja_learning.core.trial import Look, MeanFace, Trial, unknown_ranges

TRIALS, TEST_LOOKS = 600, 250
LOOKS = TRIALS + TEST_LOOKS
"""Looks at each caregiver: the first are to learn from, the last for the test."""
ARRANGEMENTS = 4
"""Each look is asked so often, among other objects, to reduce the influence of chance."""

# Where the objects of the default scene may stand, and how near to her face and to each other.
_FIELD_RAD = np.radians([40.0, 15.0])
_DISTANCES_M = (0.6, 1.0)
_FROM_FACE_RAD, _APART_RAD = np.radians([8.0, 5.0])


@dataclass(frozen=True)
class Question:
    """A look at her, and what the robot sees around: which of the objects does she attend to?

    `posture`: (2,) [rad], of the robot's head. `places`: (n, 2) [rad], directions of the objects,
    the attended one first; `ranges`: (n, 2) [m], their distances and standard deviations, NaN
    where unknown.
    """

    look: Look
    posture: NDArray[np.float64]
    places: NDArray[np.float64]
    ranges: NDArray[np.float64]

    def trial(self, rng: np.random.Generator, labelled: bool = False) -> Trial:
        """Return the trial in which the robot fixates any of the objects.

        `labelled`: the attended object is the only candidate.
        """
        count = len(self.places)
        shown = np.arange(1) if labelled else rng.permutation(count)
        look = self.look
        return Trial(
            look.face,
            look.face_at,
            self.posture[None],
            self.places[rng.integers(count)],
            self.places[shown],
            len(shown),
            self.ranges[shown],
            look.face_range,
            look.gaze,
            look.mean_face,
        )


def look_of(
    looks: Looks,
    index: int,
    face_range: NDArray[np.float64] | None = None,
    mean_face: MeanFace | None = None,
) -> Look:
    """Return one of the looks as the robot has it; `face_range`, `mean_face`: as in `Look`."""
    return Look(
        looks.faces[index],
        looks.faces_at[index],
        unknown_ranges(1)[0] if face_range is None else face_range,
        FaceGaze.from_row(looks.gazes[index]),
        mean_face,
    )


def draw_question(
    rng: np.random.Generator,
    looks: Looks,
    index: int,
    objects: int,
    depth: float | None = None,
    elsewhere: bool = False,
    mean_face: MeanFace | None = None,
) -> Question:
    """Draw other objects beside the one that she attended to in this look.

    `depth`: the error of all ranges as a share of them; None: no ranges. `elsewhere`: another
    object stands in place of the attended one. `mean_face`: hers, as far as the robot knows it.
    """
    posture = looks.postures[index]
    attended = _draw_place(rng, []) if elsewhere else looks.directions[index] - posture
    places = posture + _draw_places(rng, attended, objects)
    if depth is None:
        look = look_of(looks, index, None, mean_face)
        return Question(look, posture, places, unknown_ranges(objects))
    others = rng.uniform(*_DISTANCES_M, objects - 1)
    distances = np.append(looks.object_distances[index], others)
    ranges = _measured(rng, distances, depth)
    face_range = _measured(rng, looks.face_distances[index : index + 1], depth)[0]
    return Question(look_of(looks, index, face_range, mean_face), posture, places, ranges)


def draw_test(
    looks: Looks,
    objects: int,
    seed: int,
    depth: float | None = None,
    mean_face: MeanFace | None = None,
) -> Iterator[Question]:
    """Draw the questions about each of the looks: the same for the same seed."""
    rng = np.random.default_rng([seed, objects, 1])
    for index in range(len(looks)):
        asked = [
            draw_question(rng, looks, index, objects, depth, mean_face=mean_face)
            for _ in range(ARRANGEMENTS)
        ]
        # A learner codes a look once. With ranges, that of her face differs.
        yield from asked if depth else (replace(each, look=asked[0].look) for each in asked)


def practise(
    learner: Learner,
    tracker: MeanFaceTracker,
    rng: np.random.Generator,
    looks: Looks,
    index: int,
    objects: int,
    depth: float | None = None,
) -> MeanFace:
    """Let a learner learn from one of the looks; return her mean face, as far as it is known.

    `depth`: as in `draw_question`.
    """
    mean_face = tracker.observe(looks.faces[index], begins_look=True)
    question = draw_question(rng, looks, index, objects, depth, mean_face=mean_face)
    learner.update(question.trial(rng))
    return mean_face


def success(learner: Predictor, questions: Iterable[Question]) -> float:
    """Return how often the learner alone chooses the attended object, 0-1.

    Where a look shows the learner nothing, it chooses by chance.
    """
    right = []
    for each in questions:
        delta = learner.propose(each.look, each.posture, each.places, each.ranges)
        if delta is None:
            right.append(1 / len(each.places))
        else:
            off = each.places - each.posture - delta
            right.append(float(np.argmin(np.hypot(*off.T)) == 0))
    return float(np.mean(right))


def render_looks(orders: Iterable[LooksOrder]) -> None:
    """Render the looks that are not cached, orders side by side; `load_looks` then reads them."""
    run_in_processes('looks', _render_order, [(order,) for order in dict.fromkeys(orders)])


def load_order(order: LooksOrder) -> Looks:
    """Return the looks of an order, rendered if they are not cached."""
    return load_looks(order.scene, order.seed, order.count, senses=order.senses, photo=order.photo)


def _render_order(order: LooksOrder) -> None:
    load_order(order)


def next_seed(seeds: range, seed: int) -> int:
    """Return the seed of another caregiver among these."""
    return seeds[(seeds.index(seed) + 1) % len(seeds)]


def _draw_places(
    rng: np.random.Generator, attended: NDArray[np.float64], objects: int
) -> NDArray[np.float64]:
    """Draw displacements (objects, 2) [rad] from the look, that of the attended object first."""
    places = [attended]
    while len(places) < objects:
        places.append(_draw_place(rng, places))
    return np.array(places)


def _draw_place(rng: np.random.Generator, taken: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    while True:
        place = rng.uniform(-_FIELD_RAD, _FIELD_RAD)
        clear = all(np.hypot(*(place - other)) > _APART_RAD for other in taken)
        if clear and np.hypot(*place) > _FROM_FACE_RAD:
            return place


def _measured(
    rng: np.random.Generator, distances: NDArray[np.float64], share: float
) -> NDArray[np.float64]:
    found = distances * (1 + share * rng.normal(size=len(distances)))
    return np.stack([found, share * found], axis=1)
