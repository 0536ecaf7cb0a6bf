"""What a learner lives through, image by image: looks, glances, shifts, and a fixation at last."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.geometry import directions_of_rays
from ja_common.core.posture import Posture
from ja_learning.core.learner import Predictor
from ja_learning.core.look_around import LookAround, LookAroundConfig
from ja_learning.core.trial import Trial, TrialRecorder

BELIEF_SAMPLES = 200


@dataclass(frozen=True)
class Proposal:
    """What the learner says on an image: changes of posture (2,) [rad], or None.

    `delta`: to what she means. `glance`: to a view that is worth a glance before that.
    `log_evidence` [nats]: that the face tells the learner something, when it was last asked.
    `given_up`: the trial before, if this image shows that it was.
    """

    log_evidence: float
    given_up: Trial | None = None
    delta: NDArray[np.float64] | None = None
    glance: NDArray[np.float64] | None = None


class LearningModule:
    """Cuts what is seen into trials, and asks for what is believed while one is under way.

    Who learns from the trials, and when, is the caller's affair.
    """

    def __init__(
        self,
        believer: Callable[[], Predictor],
        look_around: LookAroundConfig,
        still_below_rad_s: float,
        seed: int,
    ) -> None:
        """`believer` gives what is believed now; it is asked only while a trial is under way."""
        self._believer = believer
        self._trial = TrialRecorder()
        self._around = LookAround(look_around)
        self._still_below = still_below_rad_s
        self._random = np.random.default_rng(seed)
        self._log_evidence = 0.0

    def see(
        self, posture: Posture, rays: ArrayLike, attended: tuple[ArrayLike, ArrayLike] | None
    ) -> Proposal:
        """One image: rays (m, 2) to objects, and what of the face, if it is attended to.

        `attended`: her face, uint8 (30, 25), and the ray (2,) to it.
        """
        trial, here = self._trial, posture.position
        still = posture.is_still(self._still_below)
        given_up = None
        if attended is not None:
            face, ray = attended
            given_up = trial.look(face, directions_of_rays(here, ray), here)
            self._around.begin(here, self._log_evidence)
        elif still:
            trial.rest(here)
        if trial.face is None:
            return Proposal(self._log_evidence)
        if still:
            if not self._around.rest(here):
                trial.shift()
            trial.see(directions_of_rays(here, rays))
        view = self._around.wanted(lambda: self.believed(self._random))
        believer = self._believer()
        self._log_evidence = believer.log_evidence
        delta = believer.propose(trial.face, trial.face_at, here, trial.candidates)
        glance = None if view is None else view - here
        return Proposal(self._log_evidence, given_up, delta, glance)

    def believed(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """Directions (BELIEF_SAMPLES, 2) [rad] of what she may mean; (0, 2) between trials."""
        face = self._trial.face
        if face is None:
            return np.empty((0, 2))
        return self._believer().belief(face, self._trial.face_at, rng, BELIEF_SAMPLES)

    def fixate(self, posture: Posture, direction: ArrayLike) -> Trial | None:
        """An object in this direction (2,) [rad] is fixated: the trial, if one was open."""
        return self._trial.fixate(posture.position, direction)

    def forget(self) -> None:
        """Drop the trial under way."""
        self._trial.forget()
