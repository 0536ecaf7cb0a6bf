"""What a learner alone makes of a person's stills: how often it finds the thing she looks at."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ja_benchmarks.learner_alone import draw_test, practise, success
from ja_common.core.config import ConfigError
from ja_experiments.datasets.looks import Looks
from ja_experiments.datasets.stills import load_stills
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.learner_registry import make_learner
from ja_learning.core.mean_face import MeanFaceTracker

OBJECTS = 5
TRIALS = (25, 50, 100)
_TESTED_SHARE = 0.3
LEAST_STILLS = 10
_ASIDE_RAD = np.radians(5.0)
"""Nearer to her face stands no thing: she looks at the robot."""


def score_stills(
    folder: Path, seed: int = 0, reads_gaze: bool = False, report: Callable[[str], None] = print
) -> dict[str, dict[int, float]]:
    """Print and return the success of the learner alone, 0-1, after `TRIALS`, by person.

    For each person the learner starts from initial weights. Stills in which she looks into the
    camera are left out. It learns without labels from a part of her stills, drawn again and again
    with other things around, and is tested on the others.
    Raises ConfigError where no person has enough stills.
    """
    found: dict[str, dict[int, float]] = {}
    for person, every in load_stills(folder, report, reads_gaze=reads_gaze).items():
        looks = _chosen(every, np.flatnonzero(np.hypot(*every.directions.T) > _ASIDE_RAD))
        if len(looks) < LEAST_STILLS:
            report(
                f'{person}: {len(looks)} stills that look aside are too few; {LEAST_STILLS} are '
                'needed'
            )
            continue
        found[person] = learning_curve(looks, seed, 'landmarks' if reads_gaze else 'pixels')
        values = '  '.join(f'{share:.2f} after {n}' for n, share in found[person].items())
        report(f'{person}: {values} trials ({len(looks)} stills)')
    if not found:
        raise ConfigError(f'{folder}: no person has {LEAST_STILLS} stills with a face')
    means = '  '.join(
        f'{np.mean([curve[n] for curve in found.values()]):.2f} after {n}' for n in TRIALS
    )
    report(f'mean of {len(found)} persons: {means} trials; chance {1 / OBJECTS:.2f}')
    return found


def learning_curve(
    looks: Looks, seed: int, reader: str = 'pixels', trials: Sequence[int] = TRIALS
) -> dict[int, float]:
    """Return the success of one learner alone on stills that it never learned from."""
    rng = np.random.default_rng([seed, len(looks)])
    order = rng.permutation(len(looks))
    tested_count = max(2, round(_TESTED_SHARE * len(looks)))
    tested, learned = _chosen(looks, order[:tested_count]), _chosen(looks, order[tested_count:])
    learner = make_learner('gaze_line', seed, GazeLineConfig(face_reader=reader))
    tracker = MeanFaceTracker()
    curve: dict[int, float] = {}
    for trial in range(1, max(trials) + 1):
        index = int(rng.integers(len(learned)))
        mean_face = practise(learner, tracker, rng, learned, index, OBJECTS)
        if trial in trials:
            test = draw_test(tested, OBJECTS, seed, mean_face=mean_face)
            curve[trial] = success(learner.snapshot(), test)
    return curve


def _chosen(looks: Looks, indices: np.ndarray) -> Looks:
    return Looks(**{name: values[indices] for name, values in vars(looks).items()})
