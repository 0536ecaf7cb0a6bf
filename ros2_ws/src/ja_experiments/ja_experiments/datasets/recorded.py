"""Recorded looks in place of rendered ones: the paper's experiment on a data set of trials."""

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
    'fixation': 'nothing but what the robot fixated, which may be another object',
}
# Of a data set that is smaller than the paper's and a test set.
_LEARNED_SHARE = 0.8


def recorded_materials(folder: Path, pool: int, scene: str) -> Materials:
    """The looks of a data set, the first `pool` of them to learn from, the rest to test on.

    `pool` 0: `POOL`, or four fifths of what there is. Other objects are placed as in the scene,
    around where the head looked at her, and wherever anything was recorded. Raises ConfigError
    when nothing would be left to test on.
    """
    samples = read_dataset(folder)
    looks = looks_of(samples)
    pool = pool or min(POOL, int(_LEARNED_SHARE * len(looks)))
    if not 1 < pool < len(looks) - 1:
        raise ConfigError(
            f'{folder} has {len(looks)} trials: with {pool} to learn from, two at least must be '
            'left to test on; name another --pool, or record more'
        )
    known = Counter(sample.target[0] for sample in samples)
    told = '; '.join(f'{known[by]} by {text}' for by, text in _KNOWN_BY.items() if known[by])
    origin = (
        f'recorded looks of {len(looks)} (`{folder.name}`), in the order in which they were '
        f'recorded. What she meant is known, of all of them: {told}'
    )
    return Materials.of(looks, places_around(looks, load_scene(scene).objects), origin, pool)


def looks_of(samples: Sequence[TrialSample]) -> Looks:
    """The data sets of the paper's experiment: faces, and where the thing was that she meant."""
    return Looks(
        np.array([sample.lesson.face for sample in samples]).reshape(-1, *FACE_SHAPE),
        np.array([sample.lesson.face_at for sample in samples]).reshape(-1, 2),
        np.array([sample.lesson.postures[0] for sample in samples]).reshape(-1, 2),
        np.array([sample.target[1] for sample in samples]).reshape(-1, 2),
    )


def places_around(looks: Looks, places: ObjectsSpec) -> ObjectsSpec:
    """The scene's places seen from where she was looked at, and wide enough for all she meant."""
    centre = np.degrees(np.median(looks.postures, axis=0))
    meant = np.degrees(looks.directions)

    def widened(place: tuple[float, float], axis: int) -> tuple[float, float]:
        low, high = np.add(place, centre[axis])
        return float(min(low, *meant[:, axis])), float(max(high, *meant[:, axis]))

    return replace(
        places, pan_deg=widened(places.pan_deg, 0), tilt_deg=widened(places.tilt_deg, 1)
    )
