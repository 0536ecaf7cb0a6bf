"""Entrants that come with the benchmark: without learning, of this project, and of others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import ConfigError, Configuration
from ja_common.core.face_gaze import FaceGaze
from ja_experiments.learning_tasks.drawn_trials import Observation, towards
from ja_experiments.learning_tasks.entrant import Entrant, load_entrant
from ja_experiments.learning_tasks.ppo_entrant import PpoEntrant, check_library
from ja_experiments.learning_tasks.tabular_entrant import TabularEntrant
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.learner import Predictor
from ja_learning.core.learner_registry import make_learner
from ja_learning.core.mean_face import MeanFaceTracker
from ja_learning.core.track import Track
from ja_learning.core.trial import Look, MeanFace, Trial, unknown_ranges


class ChanceEntrant:
    """Turns to any of the objects."""

    track = 'strict'

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)

    def propose(self, observation: Observation) -> NDArray:
        """Return the turn to an object drawn at random."""
        return towards(observation, int(self._rng.integers(len(observation['objects']))))

    def learn(self, observation: Observation, fixated: int) -> None:
        """Learn nothing."""


class MostSalientEntrant:
    """Turns to the most salient object: the robot of the paper before it learns."""

    track = 'strict'

    def __init__(self, seed: int) -> None:
        """Take the seed, which makes no difference."""

    def propose(self, observation: Observation) -> NDArray:
        """Return the turn to the most salient object."""
        return towards(observation, int(np.argmax(observation['salience'])))

    def learn(self, observation: Observation, fixated: int) -> None:
        """Learn nothing."""


class ProjectEntrant:
    """A learner of this project; where it has no proposal, the most salient object."""

    def __init__(
        self, seed: int, kind: str, config: Configuration | None = None, depth: bool = False
    ) -> None:
        """Make an untrained learner; `kind`, `config`: as in `make_learner`."""
        learner = make_learner(kind, seed, config)
        self.track = str(Track.of_learner(learner.config, depth))
        self._update = learner.update
        self._snapshot: Callable[[], Predictor] = learner.snapshot
        self._predictor: Predictor = learner
        self._faces = MeanFaceTracker()
        self._mean_face: MeanFace | None = None

    def propose(self, observation: Observation) -> NDArray:
        """Return the proposal of the learner."""
        delta = self._predictor.propose(
            _look(observation, self._mean_face),
            observation['posture'].astype(float),
            observation['objects'].astype(float),
            _ranges(observation),
        )
        if delta is None:
            return towards(observation, int(np.argmax(observation['salience'])))
        return delta

    def learn(self, observation: Observation, fixated: int) -> None:
        """Learn from the trial; all objects were seen before the head acted on the face."""
        self._mean_face = self._faces.observe(observation['face'], begins_look=True)
        look = _look(observation, self._mean_face)
        objects = observation['objects'].astype(float)
        self._update(
            Trial(
                look.face,
                look.face_at,
                observation['posture'].astype(float)[None],
                objects[fixated],
                objects,
                len(objects),
                _ranges(observation),
                look.face_range,
                look.gaze,
                look.mean_face,
            )
        )

    def __deepcopy__(self, memo: dict[int, Any]) -> ProjectEntrant:
        """Return what it believes now, for a test, in which the mean face stays as it is."""
        frozen = object.__new__(ProjectEntrant)
        frozen.track, frozen._predictor = self.track, self._snapshot()
        frozen._mean_face = self._mean_face
        return frozen


def _look(observation: Observation, mean_face: MeanFace | None) -> Look:
    face_range = observation.get('face_range', unknown_ranges(1)[0]).astype(float)
    gaze = None
    if 'gaze' in observation:
        row = np.where(observation['gaze_read'], observation['gaze'], np.nan)
        gaze = FaceGaze.from_row(row.astype(float))
    face, face_at = observation['face'], observation['face_direction'].astype(float)
    return Look(face, face_at, face_range, gaze, mean_face)


def _ranges(observation: Observation) -> NDArray[np.float64]:
    unknown = unknown_ranges(len(observation['objects']))
    return observation.get('ranges', unknown).astype(float)


_LANDMARKS = GazeLineConfig(face_reader='landmarks')
BASELINES: Mapping[str, Callable[[int], Entrant]] = {
    'chance': ChanceEntrant,
    'most-salient': MostSalientEntrant,
    'tabular': TabularEntrant,
    'paper': partial(ProjectEntrant, kind='paper'),
    'fast': partial(ProjectEntrant, kind='gaze_line'),
    'fast-depth': partial(ProjectEntrant, kind='gaze_line', depth=True),
    'fast-landmarks': partial(ProjectEntrant, kind='gaze_line', config=_LANDMARKS),
    'fast-landmarks-depth': partial(
        ProjectEntrant, kind='gaze_line', config=_LANDMARKS, depth=True
    ),
    'ppo': PpoEntrant,
}
"""By name: what makes the entrant from a seed."""


def find_entrant(name: str) -> Callable[[int], Entrant]:
    """Return what makes an entrant from a seed: a baseline, or `MODULE:CLASS`.

    Raises ConfigError when there is none, or its library is missing.
    """
    if name == 'ppo':
        check_library()
    if name in BASELINES:
        return BASELINES[name]
    if ':' not in name:
        raise ConfigError(
            f'{name!r:.50} is no baseline: write MODULE:CLASS, or one of {", ".join(BASELINES)}'
        )
    return load_entrant(name)
