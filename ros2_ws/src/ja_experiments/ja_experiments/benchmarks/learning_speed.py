"""How many trials until a learner knows what she looks at? The fast learner beside the paper's.

A fresh look every trial, each seed another caregiver; everything that was seen is a candidate, and
the learner alone chooses among the objects of 500 looks that it never learned from. The paper's
network learns from the object that it happened to fixate, drawn among all that were seen, as in
its first stage; of its proposal the nearest object is taken.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ja_experiments.looks import Looks, load_looks
from ja_learning.core.gaze_line import GazeLineConfig, GazeLineLearner
from ja_learning.core.learner import Learner
from ja_learning.core.network import NetworkConfig, ThreeLayerNetwork
from ja_learning.core.trial import Trial

MARKS = {3: (25, 50, 100, 200), 5: (50, 100, 150, 400), 10: (200, 400, 600)}
SEEDS = range(5)
_TEST_LOOKS = 500
# LEARNING geometry of the default scene: where objects may stand, and how near to each other.
_FIELD_RAD = np.radians([40.0, 15.0])
_FROM_FACE_RAD, _APART_RAD = np.radians([8.0, 5.0])


def run() -> dict[str, dict[str, Any]]:
    """Success of the learner alone after so many trials: mean over seeds and its 95 % interval."""
    rows: dict[str, dict[str, Any]] = {}
    longest = max(max(marks) for marks in MARKS.values())
    looks = {seed: load_looks('default', seed, longest + _TEST_LOOKS) for seed in SEEDS}
    for kind in (GazeLineLearner.kind, ThreeLayerNetwork.kind):
        for objects, marks in MARKS.items():
            curves = np.array([curve(kind, objects, marks, looks[seed], seed) for seed in SEEDS])
            half = 1.96 * curves.std(axis=0, ddof=1) / np.sqrt(len(curves))
            for mark, mean, width in zip(marks, curves.mean(axis=0), half, strict=True):
                rows[f'{kind}, {objects} objects, {mark} trials'] = {
                    'value': float(mean),
                    'unit': 'success',
                    'n': len(curves),
                    'interval': [float(mean - width), float(mean + width)],
                }
    return rows


def curve(kind: str, objects: int, marks: tuple[int, ...], looks: Looks, seed: int) -> list[float]:
    """Success of one learner alone, 0-1, after each of `marks` trials."""
    rng = np.random.default_rng([seed, objects])
    learner = _untaught(kind, seed)
    meant = looks.directions - looks.postures
    tests = [_places(rng, meant[i], objects) for i in range(-_TEST_LOOKS, 0)]
    found = []
    for trial in range(max(marks)):
        places = _places(rng, meant[trial], objects)
        fixated = places[rng.integers(objects)]
        at_her = np.zeros((1, 2))
        learner.learn(Trial(looks.faces[trial], at_her, fixated, places))
        if trial + 1 in marks:
            right = [
                _chosen(learner, looks.faces[i - _TEST_LOOKS], places) == 0
                for i, places in enumerate(tests)
            ]
            found.append(float(np.mean(right)))
    return found


def _untaught(kind: str, seed: int) -> Learner:
    if kind == GazeLineLearner.kind:
        return GazeLineLearner(GazeLineConfig(), seed)
    return ThreeLayerNetwork(NetworkConfig(), seed)


def _chosen(learner: Learner, face: NDArray[np.uint8], places: NDArray[np.float64]) -> int:
    here = np.zeros(2)
    aim = learner.propose(face, here, here, places)
    return int(np.argmin(np.hypot(*(places - aim).T)))


def _places(
    rng: np.random.Generator, meant: NDArray[np.float64], objects: int
) -> NDArray[np.float64]:
    """Directions (objects, 2) [rad] from her face, the one that she means first."""
    places = [meant]
    while len(places) < objects:
        place = rng.uniform(-_FIELD_RAD, _FIELD_RAD)
        apart = min(np.hypot(*(place - other)) for other in places)
        if np.hypot(*place) > _FROM_FACE_RAD and apart > _APART_RAD:
            places.append(place)
    return np.array(places)
