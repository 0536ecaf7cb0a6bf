"""From images to trials, proposals and updates: the order in which every learner learns, once.

On each image the pipeline

1. cuts: an image of a look shows that the trial before was given up,
2. proposes, with what was believed until then,
3. hands over the trial that was given up, if any,

and on each fixation it hands over the trial that the fixation has ended. The node, the recordings
(which drive the node) and the experiments all use it. It knows no truth, no thread and no ROS.
"""

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

OnTrial = Callable[[Trial, Posture], None]
"""Takes a finished trial, and the posture on the image that has ended it."""


@dataclass(frozen=True)
class Proposal:
    """What the learner proposes on an image: changes of posture (2,) [rad], or None.

    `delta`: to the gaze target. `glance`: to a view that is worth a glance before that.
    `log_evidence` [nats]: that the face informs the learner, when it was last asked.
    """

    log_evidence: float
    delta: NDArray[np.float64] | None = None
    glance: NDArray[np.float64] | None = None


class TrialPipeline:
    """The way from images to proposals and finished trials."""

    def __init__(
        self,
        predictor: Callable[[], Predictor],
        on_trial: OnTrial,
        look_around: LookAroundConfig,
        still_below_rad_s: float,
        seed: int,
    ) -> None:
        """Start between two trials.

        `predictor` returns what is believed now; it is called only while a trial is under way.
        `on_trial` takes each finished trial, those that were given up included (`Trial.fixation`
        is then None): it updates the learner, or not.
        """
        self._predictor = predictor
        self._on_trial = on_trial
        self._trial = TrialRecorder()
        self._around = LookAround(look_around)
        self._still_below = still_below_rad_s
        self._random = np.random.default_rng(seed)
        self._log_evidence = 0.0

    def process_image(
        self, posture: Posture, rays: ArrayLike, attended: tuple[ArrayLike, ArrayLike] | None
    ) -> Proposal:
        """Take one image, and return what the learner proposes on it.

        `rays`: (m, 2), to the objects. `attended`: the face, uint8 (30, 25), and the ray (2,) to
        it, if the head attends to it.
        """
        given_up = self._observe(posture, attended)
        proposal = self._propose(posture, rays)
        if given_up is not None:
            self._on_trial(given_up, posture)
        return proposal

    def process_fixation(self, posture: Posture, direction: ArrayLike) -> Trial | None:
        """Take the fixation of an object in this direction (2,) [rad].

        Returns the trial that it has ended, after handing it over; None when none was under way.
        """
        trial = self._trial.observe_fixation(posture.position, direction)
        if trial is not None:
            self._on_trial(trial, posture)
        return trial

    def draw_belief(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """Draw directions (BELIEF_SAMPLES, 2) [rad] of the gaze target; (0, 2) between trials."""
        face = self._trial.face
        if face is None:
            return np.empty((0, 2))
        return self._predictor().belief(face, self._trial.face_at, rng, BELIEF_SAMPLES)

    def drop_trial(self) -> None:
        """Drop the trial under way."""
        self._trial.drop_trial()

    def _observe(
        self, posture: Posture, attended: tuple[ArrayLike, ArrayLike] | None
    ) -> Trial | None:
        """Return the trial before, if this image shows that it was given up."""
        here = posture.position
        if attended is None:
            if posture.is_still(self._still_below):
                self._trial.observe_rest(here)
            return None
        face, ray = attended
        given_up = self._trial.observe_face(face, directions_of_rays(here, ray), here)
        self._around.start_trial(here, self._log_evidence)
        return given_up

    def _propose(self, posture: Posture, rays: ArrayLike) -> Proposal:
        trial, here = self._trial, posture.position
        if trial.face is None:
            return Proposal(self._log_evidence)
        if posture.is_still(self._still_below):
            if not self._around.observe_rest(here):
                trial.observe_shift()
            trial.record_candidates(directions_of_rays(here, rays))
        view = self._around.next_view(lambda: self.draw_belief(self._random))
        predictor = self._predictor()
        self._log_evidence = predictor.log_evidence
        delta = predictor.propose(trial.face, trial.face_at, here, trial.candidates)
        glance = None if view is None else view - here
        return Proposal(self._log_evidence, delta, glance)
