"""Looks that need no renderer: a bright spot that moves on the face as the gaze does."""

import pytest
import torch

from ja_experiments.datasets.looks import Looks
from ja_sim.core.specs import ObjectsSpec
from synthetic_trials import synthetic_looks


@pytest.fixture(scope='session', autouse=True)
def one_thread() -> None:
    """Use one thread: several test processes share the cores."""
    torch.set_num_threads(1)


@pytest.fixture(scope='session')
def places() -> ObjectsSpec:
    """Return the object ranges of the default scene."""
    return ObjectsSpec()


@pytest.fixture(scope='session')
def looks() -> Looks:
    """Return 125 looks at a face whose bright spot shows where it looks."""
    faces, postures, directions = synthetic_looks()
    return Looks(faces, postures, postures, directions)
