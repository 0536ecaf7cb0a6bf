"""Trials of a made-up life, for learners that have no world: the same number, the same trial."""

import numpy as np

from ja_learning.core.trial import Trial


def trial(number: int) -> Trial:
    """A face, one shift from the look, and four objects of which the first is fixated."""
    random = np.random.default_rng(number)
    face = random.integers(0, 256, (30, 25)).astype(np.uint8)
    candidates = random.uniform(-0.5, 0.5, (4, 2))
    postures = np.array([(0.0, 0.0), (0.1, 0.0)])
    return Trial(face, postures[0], postures, candidates[0], candidates)
