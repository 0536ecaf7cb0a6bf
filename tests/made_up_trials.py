"""Made-up trials, for learners without a world: the same number gives the same trial."""

import numpy as np

from ja_learning.core.trial import Trial


def trial(number: int) -> Trial:
    """Make a trial: a face, one shift from the look, four objects; the first one is fixated."""
    random = np.random.default_rng(number)
    face = random.integers(0, 256, (30, 25)).astype(np.uint8)
    candidates = random.uniform(-0.5, 0.5, (4, 2))
    postures = np.array([(0.0, 0.0), (0.1, 0.0)])
    return Trial(face, postures[0], postures, candidates[0], candidates)
