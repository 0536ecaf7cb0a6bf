"""A trial: a face, the postures visited, the objects seen, and what was fixated in the end.

No message announces a trial. It begins with a look at the caregiver. It ends with the first
fixation after the look, or is given up when the head looks at her again. A trial that was given up
keeps the objects that were seen in it.
"""

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.face_gaze import FaceGaze

FACE_SHAPE = (30, 25)
"""Rows and columns of the picture of the caregiver's face (Nagai et al. 2003, section 3.1)."""


class FaceFormat(NamedTuple):
    """Shape and type of what a learner reads of one face."""

    shape: tuple[int, ...]
    dtype: type[np.generic]


PICTURE = FaceFormat(FACE_SHAPE, np.uint8)

SAME_OBJECT_RAD = 0.05
"""Objects seen nearer to each other than this from two postures are one and the same."""

SAME_POSTURE_RAD = 0.02
"""Postures nearer than this in both joints are one and the same."""


def same_posture(a: ArrayLike, b: ArrayLike, within_rad: float = SAME_POSTURE_RAD) -> bool:
    """Return whether two postures (2,) [rad] are nearer than this in both joints."""
    return bool(np.all(np.abs(np.subtract(a, b)) < within_rad))


def checked_face(face: ArrayLike) -> NDArray[np.uint8]:
    """Return the picture of a face, uint8 (30, 25). Raise ValueError when it is something else."""
    face = np.asarray(face)
    if face.shape != FACE_SHAPE or face.dtype != np.uint8:
        raise ValueError(
            f'a face is uint8 of {FACE_SHAPE[0]} rows x {FACE_SHAPE[1]} columns, '
            f'got {face.dtype} of shape {face.shape}'
        )
    return face


def unknown_ranges(count: int) -> NDArray[np.float64]:
    """Return ranges (count, 2) of which nothing is known: NaN."""
    return np.full((count, 2), np.nan)


class MeanFace(NamedTuple):
    """The mean face of a person over her looks so far (`mean_face`).

    `person`: a number that is another one for another person. `picture`: float32 (30, 25), the
    mean of standardised pictures.
    """

    person: int
    picture: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Look:
    """The last image of a look at the caregiver: all that a learner may read her gaze from.

    `face`: uint8 (30, 25), seen in the direction `face_at`, (2,) [rad]. `face_range`: her distance
    and its standard deviation, (2,) [m]; NaN where unknown. `gaze`: her head pose and eyes as read
    from landmarks; None where they were not read. `mean_face`: hers, None where it is unknown.
    """

    face: NDArray[np.uint8]
    face_at: NDArray[np.float64]
    face_range: NDArray[np.float64] = field(default_factory=lambda: unknown_ranges(1)[0])
    gaze: FaceGaze | None = None
    mean_face: MeanFace | None = None


@dataclass(frozen=True)
class Trial:
    """One trial, finished: all that a learner learns from.

    `face`, `face_at`, `face_range`, `gaze`, `mean_face`: the look, as in `Look`.
    `postures`: (n, 2) [rad], where each shift began, the look at the caregiver first. `fixation`:
    (2,) [rad], direction of the object fixated at the end, or None when the trial was given up.
    `candidates`: (m, 2) [rad], directions of all objects that were seen meanwhile; the first
    `seen_before_shift` of them were seen before the head acted on the face. `ranges`: (m, 2) [m],
    their distances from the camera and standard deviations; NaN where unknown, None where no
    distance is known.
    """

    face: NDArray[np.uint8]
    face_at: NDArray[np.float64]
    postures: NDArray[np.float64]
    fixation: NDArray[np.float64] | None
    candidates: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    seen_before_shift: int = 0
    ranges: NDArray[np.float64] | None = None
    face_range: NDArray[np.float64] = field(default_factory=lambda: unknown_ranges(1)[0])
    gaze: FaceGaze | None = None
    mean_face: MeanFace | None = None

    @property
    def look(self) -> Look:
        """Return the look at the caregiver with which the trial began."""
        return Look(self.face, self.face_at, self.face_range, self.gaze, self.mean_face)

    @property
    def led_to(self) -> NDArray[np.float64]:
        """Return the fixation, (2,) [rad]; ValueError when the trial was given up."""
        if self.fixation is None:
            raise ValueError('a trial that was given up has no fixation')
        return self.fixation

    def displacements(self) -> NDArray[np.float64]:
        """Return what remained to turn at each posture, (n, 2) [rad]: the target of learning."""
        return self.led_to - self.postures


class TrialRecorder:
    """A recorder that cuts looks, postures at rest and fixations into trials."""

    def __init__(self, same_within_rad: float = SAME_POSTURE_RAD) -> None:
        """Start between two trials; postures nearer than this in both joints are the same."""
        self._same_within = same_within_rad
        self._look: Look | None = None
        self._postures: list[NDArray[np.float64]] = []
        self._candidates: list[list[float]] = []
        self._ranges: list[list[float]] = []
        self._seen_before_shift = 0
        self._looking_around = False

    @property
    def look(self) -> Look | None:
        """Return the last image of the look of the trial under way, or None between trials."""
        return self._look

    def observe_look(self, look: Look, posture: ArrayLike) -> Trial | None:
        """Start a trial, or go on with its look: the head attends to the caregiver.

        She is seen from this posture (2,) [rad]. Returns the trial before, if it was given up.
        """
        given_up = None
        if self._look is not None and len(self._postures) > 1:
            given_up = self._finished(self._look, self._postures, None)
        face, face_at = checked_face(look.face), np.array(look.face_at, float)
        self._look = replace(look, face=face, face_at=face_at)
        self._postures = [np.array(posture, float)]
        self._candidates, self._ranges = [], []
        self._seen_before_shift = 0
        self._looking_around = True
        return given_up

    def observe_rest(self, posture: ArrayLike) -> None:
        """Record a posture (2,) [rad] at which the head stands still, once if it repeats."""
        if self._look is not None and not self._same(posture, self._postures[-1]):
            self._postures.append(np.array(posture, float))

    def observe_shift(self) -> None:
        """Note that the head acts on the face: candidates from here on do not count as blind."""
        self._looking_around = False

    @property
    def candidates(self) -> NDArray[np.float64]:
        """Return the directions (m, 2) [rad] of the objects seen in the trial under way."""
        return np.array(self._candidates).reshape(-1, 2)

    @property
    def ranges(self) -> NDArray[np.float64]:
        """Return their distances and standard deviations, (m, 2) [m]; NaN where unknown."""
        return np.array(self._ranges).reshape(-1, 2)

    def record_candidates(self, directions: ArrayLike, ranges: ArrayLike | None = None) -> None:
        """Record the directions (m, 2) [rad] of objects seen while the head stands still.

        `ranges`: (m, 2) [m], as in `Trial`. One that was known stays where the newest is unknown:
        the camera turns on the spot.
        """
        if self._look is None:
            return
        found = np.asarray(directions, float).reshape(-1, 2)
        known_to = unknown_ranges(len(found)) if ranges is None else np.reshape(ranges, (-1, 2))
        for direction, its_range in zip(found.tolist(), known_to.tolist(), strict=True):
            # Many and small: numpy would take longer than all else that a proposal takes.
            distances = [math.dist(direction, known) for known in self._candidates]
            nearest = min(distances, default=math.inf)
            if nearest > SAME_OBJECT_RAD:
                self._candidates.append(direction)
                self._ranges.append(its_range)
            else:  # the newest sight counts: nearer to the centre, and things move
                index = distances.index(nearest)
                self._candidates[index] = direction
                if not math.isnan(its_range[0]):
                    self._ranges[index] = its_range
        if self._looking_around:
            self._seen_before_shift = len(self._candidates)

    def observe_fixation(self, posture: ArrayLike, direction: ArrayLike) -> Trial | None:
        """End the trial: an object in this direction (2,) [rad] is fixated from this posture.

        Returns the trial, or None when none was under way. A fixation while the head has not yet
        left the caregiver ends no trial.
        """
        began = self._postures
        if began and self._same(posture, began[-1]):
            began = began[:-1]  # where the last shift ended, none began
        if self._look is None or not began:
            return None
        trial = self._finished(self._look, began, np.array(direction, float))
        self.drop_trial()
        return trial

    def _finished(
        self,
        look: Look,
        began: list[NDArray[np.float64]],
        fixation: NDArray[np.float64] | None,
    ) -> Trial:
        return Trial(
            look.face,
            look.face_at,
            np.array(began),
            fixation,
            self.candidates,
            self._seen_before_shift,
            self.ranges,
            look.face_range,
            look.gaze,
            look.mean_face,
        )

    def drop_trial(self) -> None:
        """Drop the trial under way."""
        self._look = None
        self._postures = []
        self._candidates, self._ranges = [], []
        self._seen_before_shift = 0

    def _same(self, a: ArrayLike, b: ArrayLike) -> bool:
        return same_posture(a, b, self._same_within)
