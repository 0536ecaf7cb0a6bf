"""Trials as an entrant sees them: a look at the caregiver, and objects in random order.

Where objects stand, and how salient they are, is drawn as in the experiment of the paper
(`ja_experiments.paper.task`). The draws do not depend on the track: an entrant with more senses
sees the same trials.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import gymnasium
import numpy as np
from numpy.typing import NDArray

from ja_experiments.config import TaskConfig
from ja_experiments.datasets.looks import Looks
from ja_experiments.learning_tasks.task_table import SCENE, ScoredTask
from ja_experiments.paper.task import ATTENDED, SimulatedTask
from ja_learning.core.track import Start, Track
from ja_learning.core.trial import FACE_SHAPE
from ja_perception.core.salient_objects import InterestConfig
from ja_sim.core.scene import load_scene

Observation = dict[str, NDArray]
"""What an entrant sees of one trial, by the names of `observation_space`."""

ARRANGEMENTS = 4
"""Each look of the test is asked so often, among other objects."""
RANGE_ERROR = 0.03
"""Standard deviation of a measured distance, as a share of it."""
_LARGEST_RANGE_M = 10.0


class DrawnTrial(NamedTuple):
    """A trial: what is seen, and the index of the attended object; None if it is no object."""

    observation: Observation
    attended: int | None


class SeenObjects(NamedTuple):
    """What is known of each object, one a row: (n, 2) [rad], (n,) 0-1, (n, 2) [m].

    `ranges`: the measured distance and its standard deviation.
    """

    directions: NDArray[np.float64]
    salience: NDArray[np.float64]
    ranges: NDArray[np.float64]

    def take(self, order: NDArray[np.intp]) -> SeenObjects:
        """Return the objects in this order."""
        return SeenObjects(*(column[order] for column in self))


def observation_space(objects: int, track: Track) -> gymnasium.spaces.Dict:
    """Return the space of observations with so many objects, on a track.

    `face`: her picture, uint8 (30, 25). `face_direction`, `posture`: (2,) [rad], where her face is
    seen, and of the head. `objects`: (n, 2) [rad], directions. `salience`: (n,), 0 to 1. With
    depth also `face_range`, (2,), and `ranges`, (n, 2) [m]: distances and their standard
    deviations. With landmarks also `gaze`, (9,) [rad], a row of `FaceGaze`, and `gaze_read`, (9,):
    1 where a number was read; where it is 0, `gaze` is 0.
    """
    direction = np.pi

    def box(low: float, high: float, *shape: int) -> gymnasium.spaces.Box:
        return gymnasium.spaces.Box(low, high, shape, np.float32)

    spaces: dict[str, gymnasium.spaces.Space] = {
        'face': gymnasium.spaces.Box(0, 255, FACE_SHAPE, np.uint8),
        'face_direction': box(-direction, direction, 2),
        'posture': box(-direction, direction, 2),
        'objects': box(-direction, direction, objects, 2),
        'salience': box(0.0, 1.0, objects),
    }
    if track.depth:
        spaces['face_range'] = box(0.0, _LARGEST_RANGE_M, 2)
        spaces['ranges'] = box(0.0, _LARGEST_RANGE_M, objects, 2)
    if track.start is Start.LANDMARKS:
        spaces['gaze'] = box(-direction, direction, 9)
        spaces['gaze_read'] = gymnasium.spaces.MultiBinary(9)
    return gymnasium.spaces.Dict(spaces)


class TrialSource:
    """Draws trials of a task, as they are seen on a track."""

    def __init__(self, task: ScoredTask, track: Track) -> None:
        self._task, self._track = task, track
        self._places = load_scene(SCENE).objects
        self.space = observation_space(task.objects, track)

    def draw_trial(
        self, rng: np.random.Generator, looks: Looks, index: int, reliability: float
    ) -> DrawnTrial:
        """Draw the objects of a trial that begins with this look."""
        look = looks[index : index + 1]
        config = TaskConfig(objects=self._task.objects, reliability=reliability)
        setting = SimulatedTask(config, InterestConfig(), self._places, look).draw_setting(rng)
        is_attended = np.array_equal(setting.directions[ATTENDED], look.directions[0])
        distances = rng.uniform(*self._places.distance_m, self._task.objects)
        if is_attended:
            distances[ATTENDED] = look.object_distances[0]
        seen = SeenObjects(setting.directions, setting.features[:, 0], _measured(rng, distances))
        face_range = _measured(rng, look.face_distances)[0]
        order = rng.permutation(self._task.objects)
        attended = int(np.flatnonzero(order == ATTENDED)[0]) if is_attended else None
        return DrawnTrial(self._observation(look, seen.take(order), face_range), attended)

    def test_trials(self, rng: np.random.Generator, looks: Looks) -> Iterator[DrawnTrial]:
        """Yield the trials of a test: each look some times, she always attends to an object."""
        for index in range(len(looks)):
            for _ in range(ARRANGEMENTS):
                yield self.draw_trial(rng, looks, index, reliability=1.0)

    def _observation(
        self, look: Looks, seen: SeenObjects, face_range: NDArray[np.float64]
    ) -> Observation:
        """Return what is seen: which object is attended is no argument."""
        read = np.isfinite(look.gazes[0])
        values = {
            'face': look.faces[0],
            'face_direction': look.faces_at[0],
            'posture': look.postures[0],
            'objects': seen.directions,
            'salience': seen.salience,
            'face_range': face_range,
            'ranges': seen.ranges,
            'gaze': np.where(read, look.gazes[0], 0.0),
            'gaze_read': read,
        }
        return {name: values[name].astype(space.dtype) for name, space in self.space.items()}


def _measured(rng: np.random.Generator, distances: NDArray[np.float64]) -> NDArray[np.float64]:
    found = distances * (1 + RANGE_ERROR * rng.normal(size=len(distances)))
    return np.stack([found, RANGE_ERROR * found], axis=1)


def nearest_object(observation: Observation, action: NDArray) -> int:
    """Return the index of the object nearest to the aim of a change of posture (2,) [rad]."""
    aim = observation['posture'] + np.asarray(action, float)
    return int(np.argmin(np.hypot(*(observation['objects'] - aim).T)))


def towards(observation: Observation, index: int) -> NDArray[np.float32]:
    """Return the change of posture (2,) [rad] that turns the head to an object."""
    change: NDArray[np.float32] = observation['objects'][index] - observation['posture']
    return change
