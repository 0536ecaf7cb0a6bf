"""The looks of a task's stages, apart for practice and test."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ja_common.core.face_gaze import FaceGaze
from ja_experiments.datasets.looks import Looks, load_looks
from ja_experiments.learning_tasks.task_table import (
    OTHER_SCENE,
    PRACTICE_LOOKS,
    PRACTICE_LOOKS_AFTER,
    SCENE,
    ScoredTask,
)

TEST_LOOKS = 100

LooksSource = Callable[[str, int, int], Looks]
"""Returns looks with senses, by scene, caregiver and count."""


@dataclass(frozen=True)
class StageLooks:
    """Looks of one stage: those to learn from, and those that no learner receives in practice."""

    practice: Looks
    test: Looks


def rendered_looks(scene: str, caregiver: int, count: int) -> Looks:
    """Return looks of the rendered world with all senses, newly rendered if none are cached."""
    return load_looks(scene, caregiver, count, report=lambda line: None, senses=True)


def other_caregiver(caregiver: int) -> int:
    """Return her successor in `new-caregiver`: they are 0 and 1, 2 and 3, and so on, in turn.

    So the seeds 0 to 9 never show a face of the seeds 10 to 19.
    """
    return caregiver ^ 1


def stage_looks(
    task: ScoredTask, caregiver: int, source: LooksSource = rendered_looks
) -> list[StageLooks]:
    """Return the looks of each stage of a task at this caregiver."""

    def at(scene: str, who: int, practice: int) -> StageLooks:
        looks = source(scene, who, practice + TEST_LOOKS)
        return StageLooks(looks[:-TEST_LOOKS], looks[-TEST_LOOKS:])

    first = at(SCENE, caregiver, PRACTICE_LOOKS)
    if task.change == 'caregiver':
        return [first, at(SCENE, other_caregiver(caregiver), PRACTICE_LOOKS)]
    if task.change == 'room':
        return [first, at(OTHER_SCENE, caregiver, PRACTICE_LOOKS_AFTER)]
    if task.change == 'mirror':
        # Looks that the first stage did not show.
        unseen = first.practice[task.marks[-1] :]
        return [first, StageLooks(mirrored(unseen), mirrored(first.test))]
    return [first]


def mirrored(looks: Looks) -> Looks:
    """Return the looks with her face, and what is read of it, mirrored; places stay."""
    return replace(
        looks,
        faces=np.ascontiguousarray(looks.faces[:, :, ::-1]),
        gazes=np.array([_mirrored_row(row) for row in looks.gazes]),
    )


def _mirrored_row(row: NDArray[np.float64]) -> NDArray[np.float64]:
    gaze = FaceGaze.from_row(row)
    return row if gaze is None else gaze.mirrored().as_row()
