"""The registry of learners: by name, with the right configuration, and loaded only when made."""

import json
import subprocess
import sys

import numpy as np
import pytest

from ja_common.core.config import ConfigError
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.learner_registry import LEARNERS, LearnerChoice, make_learner
from ja_learning.core.network_config import NetworkConfig
from ja_learning.core.trial import FACE_SHAPE, Look

HEAVY = ('torch', 'numba')


def heavy_modules_after(code: str) -> set[str]:
    """Return which of the heavy modules a fresh process has loaded after this code."""
    report = f'import json, sys; print(json.dumps([m for m in {HEAVY!r} if m in sys.modules]))'
    command = [sys.executable, '-c', f'{code}\n{report}']
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout))


@pytest.mark.parametrize(
    ('code', 'loaded'),
    [
        ('import ja_learning.learning_module_node', set()),
        ('import ja_learning.core.learner, ja_learning.core.trial_pipeline', set()),
        (
            'from ja_learning.core.learner_registry import make_learner\nmake_learner("paper", 0)',
            {'torch'},
        ),
        (
            'from ja_learning.core.learner_registry import make_learner\n'
            'make_learner("gaze_line", 0)',
            {'torch', 'numba'},
        ),
    ],
)
def test_heavy_modules_are_loaded_only_for_the_learner_that_is_made(code, loaded):
    assert heavy_modules_after(code) == loaded


@pytest.mark.parametrize('kind', LEARNERS)
def test_a_learner_of_every_kind_is_made_with_its_defaults(kind):
    learner = make_learner(kind, seed=0)
    assert learner.kind == kind
    assert learner.config == LEARNERS[kind].config()
    face = np.zeros(FACE_SHAPE, np.uint8)
    assert learner.propose(Look(face, np.zeros(2)), np.zeros(2), np.empty((0, 2))).shape == (2,)


def test_the_default_is_the_learner_of_the_paper():
    assert LearnerChoice().learner == 'paper'


def test_a_learner_takes_its_own_configuration_only():
    assert make_learner('paper', 0, NetworkConfig(hidden=3)).config.hidden == 3
    with pytest.raises(ConfigError, match='paper takes a NetworkConfig, not a GazeLineConfig'):
        make_learner('paper', 0, GazeLineConfig())


def test_an_unknown_learner_is_refused_with_the_names_of_those_there_are():
    with pytest.raises(ConfigError, match=r"'teacher' is not a learner: .* paper, gaze_line"):
        make_learner('teacher', 0)
