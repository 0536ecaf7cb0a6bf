"""From images to trials, proposals and updates: the order in which every learner learns, once.

On each image the pipeline

1. cuts: an image of a look shows that the trial before was given up,
2. proposes, with what was believed until then,
3. hands over the trial that was given up, if any,

and on each fixation it hands over the trial that the fixation has ended. The node, the recordings
(which drive the node) and the experiments all use it. It knows no truth, no thread and no ROS.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.detection import Detection, caregiver_face, objects
from ja_common.core.face_gaze import FaceGaze
from ja_common.core.geometry import directions_of_rays
from ja_common.core.posture import Posture
from ja_learning.core.learner import KnowsItsGain, Predictor
from ja_learning.core.look_around import LookAround, LookAroundConfig
from ja_learning.core.mean_face import MeanFaceTracker
from ja_learning.core.trial import Look, MeanFace, Trial, TrialRecorder, checked_face

BELIEF_SAMPLES = 200

OnTrial = Callable[[Trial, Posture], None]
"""Takes a finished trial, and the posture on the image that has ended it."""


@dataclass(frozen=True)
class Proposal:
    """What the learner proposes on an image: changes of posture (2,) [rad], or None.

    `delta`: to the gaze target. `glance`: to a view that is worth a glance before that.
    `log_evidence` [nats]: that the face informs the learner, when it was last asked.
    `expected_gain`: of its choice over a choice by chance, as in `Predictor`; NaN: unknown.
    """

    log_evidence: float
    delta: NDArray[np.float64] | None = None
    glance: NDArray[np.float64] | None = None
    expected_gain: float = math.nan


class TrialPipeline:
    """The way from images to proposals and finished trials."""

    def __init__(
        self,
        predictor: Callable[[], Predictor],
        on_trial: OnTrial,
        look_around: LookAroundConfig,
        still_below_rad_s: float,
        seed: int,
        mean_face: MeanFace | None = None,
    ) -> None:
        """Start between two trials.

        `predictor` returns what is believed now; it is called only while a trial is under way.
        `on_trial` takes each finished trial, those that were given up included (`Trial.fixation`
        is then None): it updates the learner, or not. `mean_face`: that of the person of whom the
        learner has learned last, if it has.
        """
        self._predictor = predictor
        self._on_trial = on_trial
        self._trial = TrialRecorder()
        self._around = LookAround(look_around)
        self._still_below = still_below_rad_s
        self._random = np.random.default_rng(seed)
        self._log_evidence = 0.0
        self._mean_face = MeanFaceTracker(mean_face)
        self._attends = False
        self._look_stamp_ns = -1

    def process_image(
        self,
        posture: Posture,
        detections: list[Detection],
        face: ArrayLike | None,
        gaze: FaceGaze | None = None,
    ) -> Proposal:
        """Take one image, and return what the learner proposes on it.

        `face`: the picture of the caregiver's face, uint8 (30, 25), if the head attends to it, and
        `gaze`: her head pose and eyes, if they were read.
        """
        given_up = self._observe(posture, self._look(posture, detections, face, gaze))
        proposal = self._propose(posture, objects(detections))
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
        look = self._trial.look
        if look is None:
            return np.empty((0, 2))
        return self._predictor().belief(look, rng, BELIEF_SAMPLES)

    def drop_trial(self) -> None:
        """Drop the trial under way."""
        self._trial.drop_trial()

    def interrupt_trial(self, stamp_ns: int) -> None:
        """Drop the trial under way if its look was at this stamp [ns] or before.

        From that image on the head did not do what a trial asks for. A look that comes later
        belongs to the next trial, whichever of the two is known first.
        """
        if self._look_stamp_ns <= stamp_ns:
            self.drop_trial()

    def forget(self) -> None:
        """Drop the trial under way, and forget who is before the head."""
        self.drop_trial()
        self._mean_face = MeanFaceTracker()

    def _observe(self, posture: Posture, look: Look | None) -> Trial | None:
        """Return the trial before, if this image shows that it was given up."""
        here = posture.position
        if look is None:
            if posture.is_still(self._still_below):
                self._trial.observe_rest(here)
            return None
        given_up = self._trial.observe_look(look, here)
        self._look_stamp_ns = posture.stamp_ns
        self._around.start_trial(here, self._log_evidence)
        return given_up

    def _propose(self, posture: Posture, seen: list[Detection]) -> Proposal:
        trial, here = self._trial, posture.position
        if trial.look is None:
            return Proposal(self._log_evidence)
        if posture.is_still(self._still_below):
            if not self._around.observe_rest(here):
                trial.observe_shift()
            rays = np.array([each.ray for each in seen]).reshape(-1, 2)
            trial.record_candidates(directions_of_rays(here, rays), [each.range for each in seen])
        view = self._around.next_view(lambda: self.draw_belief(self._random))
        predictor = self._predictor()
        self._log_evidence = predictor.log_evidence
        delta = predictor.propose(trial.look, here, trial.candidates, trial.ranges)
        gain = math.nan
        if isinstance(predictor, KnowsItsGain):
            gain = predictor.expected_gain(trial.look, trial.candidates, trial.ranges)
        glance = None if view is None else view - here
        return Proposal(self._log_evidence, delta, glance, gain)

    def _look(
        self,
        posture: Posture,
        detections: list[Detection],
        face: ArrayLike | None,
        gaze: FaceGaze | None,
    ) -> Look | None:
        """Return the look at the caregiver that this image shows, or None."""
        seen = caregiver_face(detections)
        attended, self._attends = self._attends, face is not None and seen is not None
        if face is None or seen is None:
            return None
        picture = checked_face(face)
        face_at = directions_of_rays(posture.position, seen.ray)
        mean_face = self._mean_face.observe(picture, begins_look=not attended)
        return Look(picture, face_at, seen.range, gaze, mean_face)
