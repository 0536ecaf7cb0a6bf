"""The learners by name. A learner's module, and torch or numba with it, loads when it is made."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any, NamedTuple

from ja_common.core.config import ConfigError, Configuration, parameter
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.learner import Learner
from ja_learning.core.network_config import NetworkConfig


class LearnerEntry(NamedTuple):
    """Where a learner's class is, `module:class`, and the configuration that it takes.

    `from_landmarks`: the class, where the configuration has `face_reader: landmarks`.
    """

    learner: str
    config: type[Configuration]
    from_landmarks: str = ''


LEARNERS: Mapping[str, LearnerEntry] = {
    'paper': LearnerEntry('ja_learning.core.network:ThreeLayerNetwork', NetworkConfig),
    'gaze_line': LearnerEntry(
        'ja_learning.core.gaze_line:GazeLineLearner',
        GazeLineConfig,
        'ja_learning.core.landmark_learner:LandmarkLearner',
    ),
}
"""Every learner, by its `kind`; the first is the default."""


@dataclass(frozen=True)
class LearnerChoice(Configuration):
    """Which learner."""

    learner: str = parameter(
        next(iter(LEARNERS)),
        "the paper's network, or the fast one of lines of gaze; a change starts untrained",
        choices=tuple(LEARNERS),
    )


def make_learner(kind: str, seed: int, config: Configuration | None = None) -> Learner:
    """Make an untrained learner of this kind; without `config`, with its defaults.

    Raises ConfigError when there is no such learner, or the configuration is of another one.
    """
    if kind not in LEARNERS:
        raise ConfigError(f'{kind!r} is not a learner: choose one of {", ".join(LEARNERS)}')
    entry = LEARNERS[kind]
    config = entry.config() if config is None else config
    if not isinstance(config, entry.config):
        wanted, found = entry.config.__name__, type(config).__name__
        raise ConfigError(f'the learner {kind} takes a {wanted}, not a {found}')
    reads_landmarks = getattr(config, 'face_reader', '') == 'landmarks'
    where = entry.from_landmarks if reads_landmarks else entry.learner
    module, _, name = where.partition(':')
    make: Any = getattr(import_module(module), name)
    return make(config, seed)
