"""A trial as the learner lives it: a face, the postures visited, what was fixated in the end.

Nobody announces a trial. It begins with a look at the caregiver and ends with the first fixation
after it, or is given up: the head looks at her again. What was seen was seen in any case.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

FACE_SHAPE = (30, 25)
"""Rows and columns of the picture of the caregiver's face (Nagai et al. 2003, section 3.1)."""

SAME_OBJECT_RAD = 0.05
"""Objects seen nearer to each other than this from two postures are one and the same."""

SAME_POSTURE_RAD = 0.02
"""Postures nearer than this in both joints are one and the same."""


def same_posture(a: ArrayLike, b: ArrayLike, within_rad: float = SAME_POSTURE_RAD) -> bool:
    """Whether two postures (2,) [rad] are nearer than this in both joints."""
    return bool(np.all(np.abs(np.subtract(a, b)) < within_rad))


def checked_face(face: ArrayLike) -> NDArray[np.uint8]:
    """The picture, uint8 (30, 25), of a face. Raises ValueError when it is something else."""
    face = np.asarray(face)
    if face.shape != FACE_SHAPE or face.dtype != np.uint8:
        raise ValueError(
            f'a face is uint8 of {FACE_SHAPE[0]} rows x {FACE_SHAPE[1]} columns, '
            f'got {face.dtype} of shape {face.shape}'
        )
    return face


@dataclass(frozen=True)
class Trial:
    """What one trial gives to learn from.

    `face`: uint8 (30, 25), seen in the direction `face_at`, (2,) [rad]. `postures`: (n, 2) [rad],
    where each shift began, the look at the caregiver first. `fixation`: (2,) [rad], direction of
    the object fixated at the end, or None when the trial was given up.
    `candidates`: (m, 2) [rad], directions of all objects that were seen meanwhile; the first
    `seen_before_shift` of them were seen before anybody acted on what the face told.
    """

    face: NDArray[np.uint8]
    face_at: NDArray[np.float64]
    postures: NDArray[np.float64]
    fixation: NDArray[np.float64] | None
    candidates: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    seen_before_shift: int = 0

    @property
    def led_to(self) -> NDArray[np.float64]:
        """The fixation, (2,) [rad]; ValueError when the trial was given up."""
        if self.fixation is None:
            raise ValueError('a trial that was given up has led nowhere')
        return self.fixation

    def displacements(self) -> NDArray[np.float64]:
        """What remained to turn at each posture, shape (n, 2) [rad]: the target of learning."""
        return self.led_to - self.postures


class TrialRecorder:
    """Cuts the stream of looks, postures at rest and fixations into trials."""

    def __init__(self, same_within_rad: float = SAME_POSTURE_RAD) -> None:
        self._same_within = same_within_rad
        self._face: NDArray[np.uint8] | None = None
        self._face_at = np.zeros(2)
        self._postures: list[NDArray[np.float64]] = []
        self._candidates: list[list[float]] = []
        self._seen_before_shift = 0
        self._looking_around = False

    @property
    def face(self) -> NDArray[np.uint8] | None:
        """The face seen in the last look of the trial under way, or None between trials."""
        return self._face

    def look(self, face: ArrayLike, face_at: ArrayLike, posture: ArrayLike) -> Trial | None:
        """The head attends to the caregiver: a trial begins, or its look goes on.

        Her face is seen in the direction `face_at` (2,) [rad].
        The trial before, if it was given up.
        """
        given_up = None
        if self._face is not None and len(self._postures) > 1:
            given_up = self._ended(self._postures, None)
        self._face, self._face_at = checked_face(face), np.array(face_at, float)
        self._postures = [np.array(posture, float)]
        self._candidates = []
        self._seen_before_shift = 0
        self._looking_around = True
        return given_up

    def rest(self, posture: ArrayLike) -> None:
        """The head stands still at a posture (2,) [rad]; repeated postures count once."""
        if self._face is not None and not self._same(posture, self._postures[-1]):
            self._postures.append(np.array(posture, float))

    def shift(self) -> None:
        """From here to the next look, the head turns where somebody believes that she looks."""
        self._looking_around = False

    @property
    def face_at(self) -> NDArray[np.float64]:
        """Direction (2,) [rad] in which the face was last seen."""
        return self._face_at

    @property
    def candidates(self) -> NDArray[np.float64]:
        """Directions (m, 2) [rad] of the objects seen in the trial under way."""
        return np.array(self._candidates).reshape(-1, 2)

    def see(self, directions: ArrayLike) -> None:
        """Objects stand in these directions (m, 2) [rad], seen while the head stands still."""
        if self._face is None:
            return
        for direction in np.asarray(directions, float).reshape(-1, 2).tolist():
            # Many and small: numpy would take longer than all else that a proposal takes.
            distances = [math.dist(direction, known) for known in self._candidates]
            nearest = min(distances, default=math.inf)
            if nearest > SAME_OBJECT_RAD:
                self._candidates.append(direction)
            else:  # the newest sight counts: nearer to the centre, and things move
                self._candidates[distances.index(nearest)] = direction
        if self._looking_around:
            self._seen_before_shift = len(self._candidates)

    def fixate(self, posture: ArrayLike, direction: ArrayLike) -> Trial | None:
        """An object in this direction is fixated from this posture: the trial, if one was open.

        What stands in the centre while the head has not yet left the caregiver ends nothing.
        """
        began = self._postures
        if began and self._same(posture, began[-1]):
            began = began[:-1]  # where the last shift ended, none began
        if self._face is None or not began:
            return None
        trial = self._ended(began, np.array(direction, float))
        self.forget()
        return trial

    def _ended(
        self, began: list[NDArray[np.float64]], fixation: NDArray[np.float64] | None
    ) -> Trial:
        assert self._face is not None
        return Trial(
            self._face,
            self._face_at,
            np.array(began),
            fixation,
            self.candidates,
            self._seen_before_shift,
        )

    def forget(self) -> None:
        """Drop the trial under way."""
        self._face = None
        self._postures = []
        self._candidates = []
        self._seen_before_shift = 0

    def _same(self, a: ArrayLike, b: ArrayLike) -> bool:
        return same_posture(a, b, self._same_within)
