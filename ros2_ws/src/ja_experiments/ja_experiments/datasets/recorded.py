"""Make looks from a data set of recorded trials, in place of rendered looks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ja_common.core.config import ConfigError
from ja_experiments.datasets.looks import POOL, Looks
from ja_experiments.paper.experiment import Materials
from ja_learning.core.trial import FACE_SHAPE
from ja_recording.core.dataset import TrialSample, read_dataset
from ja_sim.core.scene import load_scene
from ja_sim.core.specs import ObjectsSpec

_KNOWN_BY = {
    'label': "a person's label",
    'truth': 'the truth of a simulation',
    'fixation': 'only the object that the robot fixated, which may be another object',
}
# Used for a data set that is smaller than the paper's pool and a test set together.
_LEARNED_SHARE = 0.8


def recorded_materials(folder: Path, pool: int, scene: str) -> Materials:
    """Return the looks of a data set: the first `pool` to learn from, the rest to test on.

    `pool` 0: `POOL`, or four fifths of all looks. Other objects are placed as `places_around`
    computes. Raises ConfigError when fewer than two looks are left to test on.
    """
    samples = read_dataset(folder)
    looks = looks_from_samples(samples)
    pool = pool or min(POOL, int(_LEARNED_SHARE * len(looks)))
    if not 1 < pool < len(looks) - 1:
        raise ConfigError(
            f'{folder} has {len(looks)} trials: with {pool} to learn from, at least two must be '
            'left to test on; name another --pool, or record more'
        )
    known = Counter(sample.target[0] for sample in samples)
    sources = '; '.join(f'{known[by]} by {text}' for by, text in _KNOWN_BY.items() if known[by])
    origin = (
        f'recorded looks of {len(looks)} (`{folder.name}`), in the order in which they were '
        f'recorded. The attended object is known: {sources}'
    )
    return Materials.from_looks(
        looks, places_around(looks, load_scene(scene).objects), origin, pool
    )


def looks_from_samples(samples: Sequence[TrialSample]) -> Looks:
    """Return the faces and attended directions of recorded trials as looks."""
    return Looks(
        np.array([sample.trial.face for sample in samples]).reshape(-1, *FACE_SHAPE),
        np.array([sample.trial.face_at for sample in samples]).reshape(-1, 2),
        np.array([sample.trial.postures[0] for sample in samples]).reshape(-1, 2),
        np.array([sample.target[1] for sample in samples]).reshape(-1, 2),
    )


def places_around(looks: Looks, places: ObjectsSpec) -> ObjectsSpec:
    """Return the scene's ranges, moved to the median look, and wide enough for every direction."""
    centre = np.degrees(np.median(looks.postures, axis=0))
    attended = np.degrees(looks.directions)

    def widened(place: tuple[float, float], axis: int) -> tuple[float, float]:
        low, high = np.add(place, centre[axis])
        return float(min(low, *attended[:, axis])), float(max(high, *attended[:, axis]))

    return replace(
        places, pan_deg=widened(places.pan_deg, 0), tilt_deg=widened(places.tilt_deg, 1)
    )
