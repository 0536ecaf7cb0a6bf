"""How many trials until a learner knows what she looks at? The fast learner beside the paper's.

Each trial has a fresh look, each seed another caregiver, and every object that was seen is a
candidate. In the test the learner alone chooses among the objects of 500 looks that it never
learned from. Each look is asked four times, with other objects beside the attended object. The
paper's network learns from the object that it happened to fixate, drawn among all that were seen,
as in its first stage; the object nearest to its proposal is taken. The ceilings are those of
`./ja bench world`, for an observer that knows the exact direction of her eyes, or of her head. A
third ceiling is the fast learner with the attended object as its label, which no robot has: the
most that its networks learn from as many pictures of her face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ja_benchmarks.ceiling import ceiling
from ja_benchmarks.rows import Row, success_row
from ja_experiments.datasets.looks import POOL, Looks, load_looks
from ja_experiments.processes import run_in_processes
from ja_learning.core.gaze_line import GazeLineLearner
from ja_learning.core.learner import Predictor
from ja_learning.core.learner_registry import make_learner
from ja_learning.core.network import ThreeLayerNetwork
from ja_learning.core.trial import Look, Trial

SEEDS = range(10)
TRIALS = 2000
TEST_LOOKS = 500
# Each look is asked so often, among other objects, to reduce the influence of chance.
ARRANGEMENTS = 4
LOOKS = TRIALS + TEST_LOOKS
LOOKS_IN_ANOTHER_ROOM = 100 + TEST_LOOKS
# Where the objects of the default scene may stand, and how near to her face and to each other.
_FIELD_RAD = np.radians([40.0, 15.0])
_FROM_FACE_RAD, _APART_RAD = np.radians([8.0, 5.0])


@dataclass(frozen=True)
class LearningTask:
    """A condition. `pool`: learn from so many looks, and be tested on them; 0: fresh looks.

    `marks`: the trials after which success is measured. `change_at`: after so many trials she is
    another caregiver, or sits in `another_room` (a scene); 0: never. `labelled`: the attended
    object is the only candidate.
    """

    name: str
    objects: int
    marks: tuple[int, ...]
    reliability: float = 1.0
    pool: int = 0
    change_at: int = 0
    another_room: str = ''
    labelled: bool = False


CONDITIONS = (
    LearningTask('5 objects', 5, (25, 50, 100, 150, 400)),
    LearningTask('10 objects', 10, (100, 200, 400, 600, 2000)),
    LearningTask('5 objects, pool of 125', 5, (100, 200, 300), pool=POOL),
    LearningTask('10 objects, pool of 125', 10, (200, 400, 700), pool=POOL),
    LearningTask('5 objects, 30 % of looks elsewhere', 5, (100, 150, 200, 400), reliability=0.7),
    LearningTask('5 objects, another caregiver after 400', 5, (400, 401, 425, 450), change_at=400),
    LearningTask(
        '5 objects, another room after 400', 5, (400, 401, 425, 450),
        change_at=400, another_room='bare_room',
    ),
    LearningTask('10 objects, with labels', 10, (200, 600, 2000), labelled=True),
)  # fmt: skip
KINDS = (GazeLineLearner.kind, ThreeLayerNetwork.kind)


def run() -> dict[str, Row]:
    """Measure the success of the learner alone: means over seeds with their 95 % intervals."""
    for seed in SEEDS:
        load_looks('default', seed, LOOKS)
        for condition in CONDITIONS:
            _looks_elsewhere(condition, seed)
    asked = [
        (kind, condition)
        for condition in CONDITIONS
        for kind in KINDS
        # The paper's network chooses among no candidates, so it has no labelled condition.
        if kind == GazeLineLearner.kind or not condition.labelled
    ]
    tasks = [(kind, condition, seed) for kind, condition in asked for seed in SEEDS]
    found = dict(zip(tasks, run_in_processes('learning', curve, tasks), strict=True))
    rows: dict[str, Row] = {}
    for kind, condition in asked:
        curves = np.array([found[kind, condition, seed] for seed in SEEDS])
        for mark, shares in zip(condition.marks, curves.T, strict=True):
            rows[f'{kind}, {condition.name}: {mark} trials'] = success_row(shares)
    return rows | ceiling()


def curve(kind: str, condition: LearningTask, seed: int) -> list[float]:
    """Return the success of one learner alone, 0-1, after each of the marks."""
    rng = np.random.default_rng([seed, condition.objects])
    looks = load_looks('default', seed, LOOKS)
    elsewhere = _looks_elsewhere(condition, seed)
    learner = make_learner(kind, seed)
    found = []
    for trial in range(1, max(condition.marks) + 1):
        world = elsewhere if elsewhere and trial > condition.change_at else looks
        learner.update(_trial(rng, world, trial, condition))
        if trial in condition.marks:
            tested = world[: condition.pool] if condition.pool else world[-TEST_LOOKS:]
            found.append(success(learner.snapshot(), tested, condition.objects, seed))
    return found


def _looks_elsewhere(condition: LearningTask, seed: int) -> Looks | None:
    """Return the looks after the change: another caregiver, or the same in another room."""
    if not condition.change_at:
        return None
    if condition.another_room:
        return load_looks(condition.another_room, seed, LOOKS_IN_ANOTHER_ROOM)
    return load_looks('default', (seed + 1) % len(SEEDS), LOOKS)


def success(learner: Predictor, looks: Looks, objects: int, seed: int) -> float:
    """Return how often the learner alone chooses the attended object, 0-1."""
    rng = np.random.default_rng([seed, objects, 1])
    right = []
    for face, face_at, posture, attended in zip(
        looks.faces, looks.faces_at, looks.postures, looks.directions, strict=True
    ):
        for _ in range(ARRANGEMENTS):
            places = draw_places(rng, attended - posture, objects)
            delta = learner.propose(Look(face, face_at), posture, posture + places)
            assert delta is not None  # every look shows pixels
            right.append(np.argmin(np.hypot(*(places - delta).T)) == 0)
    return float(np.mean(right))


def _trial(rng: np.random.Generator, looks: Looks, trial: int, condition: LearningTask) -> Trial:
    fresh = (trial - 1 - condition.change_at) % (len(looks) - TEST_LOOKS)
    look = int(rng.integers(condition.pool)) if condition.pool else fresh
    posture = looks.postures[look]
    attended = looks.directions[look] - posture
    if rng.random() >= condition.reliability:
        attended = _place(rng, [])
    places = posture + draw_places(rng, attended, condition.objects)
    fixated = places[rng.integers(condition.objects)]
    shown = places[:1] if condition.labelled else rng.permutation(places)
    return Trial(
        looks.faces[look], looks.faces_at[look], posture[None], fixated, shown, len(shown)
    )


def draw_places(
    rng: np.random.Generator, attended: NDArray[np.float64], objects: int
) -> NDArray[np.float64]:
    """Draw displacements (objects, 2) [rad] from the look, that of the attended object first."""
    places = [attended]
    while len(places) < objects:
        places.append(_place(rng, places))
    return np.array(places)


def _place(rng: np.random.Generator, taken: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    while True:
        place = rng.uniform(-_FIELD_RAD, _FIELD_RAD)
        clear = all(np.hypot(*(place - other)) > _APART_RAD for other in taken)
        if clear and np.hypot(*place) > _FROM_FACE_RAD:
            return place
