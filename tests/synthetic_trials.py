"""Trials with synthetic faces for tests of data sets: a bright spot moves as the gaze does."""

import numpy as np

from ja_learning.core.trial import Trial
from ja_recording.core.dataset import TrialSample

TRIALS = 125


def synthetic_looks() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return 125 faces, uint8 (n, 30, 25), postures and attended directions, (n, 2) [rad]."""
    rng = np.random.default_rng(0)
    commands = np.radians(rng.uniform((-40, -15), (40, 15), (500, 2)))
    commands = commands[np.hypot(*commands.T) > np.radians(9)][:TRIALS]
    postures = rng.normal(0.0, 0.01, commands.shape)
    row, column = np.mgrid[-1:1:30j, -1:1:25j]
    spots = [np.exp(-4 * ((column - p) ** 2 + (row - 2 * t) ** 2)) for p, t in commands]
    grey = 128 + 80 * np.array(spots) + rng.normal(0, 5, (TRIALS, 30, 25))
    return grey.clip(0, 255).astype(np.uint8), postures, postures + commands


def synthetic_samples() -> list[TrialSample]:
    """Return trials of two shifts; the fixation is 0.1 rad off the attended direction."""
    rng = np.random.default_rng(0)
    samples = []
    for number, (face, look, attended) in enumerate(zip(*synthetic_looks(), strict=True)):
        seen = rng.normal(size=(number % 4, 2))
        postures = np.array([look, attended / 3])
        trial = Trial(face, look, postures, attended + 0.1, seen, number % 3)
        samples.append(
            TrialSample(trial, 'a', 10 * number, 10 * number + 5, 'VF', attended, False)
        )
    return samples
