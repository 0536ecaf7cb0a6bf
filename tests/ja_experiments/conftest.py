"""Looks that need no renderer: a bright spot that moves on the face as the gaze does."""

import numpy as np
import pytest
import torch

from ja_experiments.datasets.looks import Looks
from ja_sim.core.specs import ObjectsSpec


@pytest.fixture(scope='session', autouse=True)
def one_thread() -> None:
    """Several test processes share the cores."""
    torch.set_num_threads(1)


@pytest.fixture(scope='session')
def places() -> ObjectsSpec:
    """Where the default scene puts objects."""
    return ObjectsSpec()


@pytest.fixture(scope='session')
def looks() -> Looks:
    """125 looks at a face whose bright spot tells where it looks."""
    rng = np.random.default_rng(0)
    commands = np.radians(rng.uniform((-40, -15), (40, 15), (500, 2)))
    commands = commands[np.hypot(*commands.T) > np.radians(9)][:125]
    postures = rng.normal(0.0, 0.01, commands.shape)
    row, column = np.mgrid[-1:1:30j, -1:1:25j]
    spots = [np.exp(-4 * ((column - p) ** 2 + (row - 2 * t) ** 2)) for p, t in commands]
    grey = 128 + 80 * np.array(spots) + rng.normal(0, 5, (125, 30, 25))
    return Looks(grey.clip(0, 255).astype(np.uint8), postures, postures, postures + commands)
