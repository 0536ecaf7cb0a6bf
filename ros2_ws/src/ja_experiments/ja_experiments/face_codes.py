"""Face codes from the rendered world: from watching her, or from trials with other people."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ja_experiments.datasets.watching import PICTURES_A_SECOND, watch
from ja_learning.core.face_code import FaceCode
from ja_learning.core.gaze_line_places import seen_places
from ja_learning.core.mean_face import standardised
from ja_learning.core.others_face_code import OtherCaregiver, others_face_code
from ja_learning.core.watched_face_code import watched_face_code
from ja_sim.core.scene import Scene

OTHERS_SEEDS, OTHERS_TRIALS = tuple(range(30, 42)), 120
"""Seeds of the other caregivers, and trials with each: none of a development or report seed."""


def code_of_watching(scene: Scene, caregiver_seed: int, seconds: float, seed: int) -> FaceCode:
    """Train on so many seconds in which the caregiver of a scene and seed was seen."""
    wanted = round(seconds * PICTURES_A_SECOND)
    pictures: list[NDArray[np.uint8]] = []
    for each in watch(scene, caregiver_seed):
        pictures.extend(each.pictures)
        if len(pictures) >= wanted:
            break
    return code_of_pictures(np.array(pictures[:wanted]), seed)


def code_of_pictures(pictures: NDArray[np.uint8], seed: int) -> FaceCode:
    """Train on pictures (n, 30, 25) of one person, taken at the rate of the world's images."""
    return watched_face_code(pictures, len(pictures) / PICTURES_A_SECOND, seed)


def code_of_others(
    scene: Scene,
    people: Sequence[str],
    seed: int,
    caregiver_seeds: Sequence[int] = OTHERS_SEEDS,
    trials: int = OTHERS_TRIALS,
    report: Callable[[str], None] = lambda line: None,
) -> FaceCode:
    """Train on so many trials with one caregiver for each of the seeds, the people in turn.

    `report` gets a line about each of them.
    """
    caregivers, pictures = [], 0
    for index, each in enumerate(caregiver_seeds):
        person = people[index % len(people)]
        caregiver, seen = _other_caregiver(scene, person, each, trials)
        caregivers.append(caregiver)
        pictures += seen
        report(f'{person} (seed {each}): {trials} trials, {seen / PICTURES_A_SECOND:.0f} s')
    return others_face_code(caregivers, pictures / PICTURES_A_SECOND, seed)


def _other_caregiver(
    scene: Scene, person: str, seed: int, trials: int
) -> tuple[OtherCaregiver, int]:
    """Return what is seen of a person in so many trials, and in how many pictures."""
    scene = replace(scene, caregiver=replace(scene.caregiver, identity=person))
    looks = list(islice(watch(scene, seed), trials))
    pictures = np.concatenate([each.pictures for each in looks])
    places = np.array([seen_places(each.look, each.objects) for each in looks], np.float32)
    faces = np.array([each.look.face for each in looks])
    mean_face = standardised(pictures).mean(axis=0)
    return OtherCaregiver(person, faces, mean_face, places), len(pictures)
