"""The robot without ROS: the cores of the graph's nodes, called in the order of its messages."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.detection import Detection, caregiver_face, most_salient
from ja_common.core.face_gaze import FaceGaze
from ja_common.core.posture import Posture
from ja_control.core.attention_cycle import AttentionCycle, CycleInput, Decision
from ja_control.core.gating import Gating
from ja_control.core.joint_limits import JointLimits
from ja_control.core.visual_feedback import visual_feedback
from ja_experiments.config import ExperimentConfig
from ja_learning.core.evaluator import EvaluatorConfig, InternalEvaluator
from ja_learning.core.learner import TrainablePredictor
from ja_learning.core.look_around import LookAroundConfig
from ja_learning.core.trial import Look, Trial
from ja_learning.core.trial_pipeline import Proposal, TrialPipeline


class FixedTurn:
    """A learner that learns nothing: the same turn from every posture, for every face."""

    log_evidence = 0.0

    def __init__(self, turn: ArrayLike) -> None:
        self._turn = np.array(turn, float)

    def propose(
        self,
        look: Look,
        posture: ArrayLike,
        candidates: ArrayLike,
        ranges: ArrayLike | None = None,
    ) -> NDArray[np.float64]:
        return self._turn

    def belief(self, look: Look, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        return np.tile(look.face_at + self._turn, (count, 1))

    def update(self, trial: Trial) -> None:
        pass


class OnlineLearner:
    """A learner, the trial pipeline and the internal evaluator: image by image, update by update.

    `taught`: as in `TaskConfig`.
    """

    def __init__(
        self,
        learner: TrainablePredictor,
        look_around: LookAroundConfig,
        evaluator: EvaluatorConfig,
        still_below_rad_s: float,
        seed: int,
        taught: str = 'fixation',
    ) -> None:
        self._learner = learner
        self._evaluator = InternalEvaluator(evaluator)
        self._pipeline = TrialPipeline(
            lambda: learner, self._update, look_around, still_below_rad_s, seed
        )
        self._taught = taught

    def step(
        self,
        detections: list[Detection],
        face: NDArray[np.uint8] | None,
        posture: Posture,
        gaze: FaceGaze | None = None,
    ) -> tuple[Proposal, NDArray[np.float64] | None]:
        """Process one image: return the proposal, and the direction (2,) [rad] fixated, or None.

        `face`: the picture of the attended face, uint8 (30, 25), or None; `gaze`: as in `Look`.
        """
        proposal = self._pipeline.process_image(posture, detections, face, gaze)
        fixation = self._evaluator.find_fixation(detections, posture)
        if fixation is not None:
            self._pipeline.process_fixation(posture, fixation)
        return proposal, fixation

    def _update(self, trial: Trial, posture: Posture) -> None:
        if trial.fixation is not None and self._taught == 'executed':
            trial = replace(trial, fixation=posture.position)
        self._learner.update(trial)


@dataclass(frozen=True)
class Step:
    """What the robot decided on one image.

    `command`: the posture (2,) [rad] that the head is sent to. `fixation`: direction (2,) [rad] of
    the object in the centre, or None. `lm_delta`: what the learner proposed, (2,) [rad], or None.
    """

    command: NDArray[np.float64]
    decision: Decision
    fixation: NDArray[np.float64] | None
    lm_delta: NDArray[np.float64] | None


class Robot:
    """Controller, learner, evaluator and gate; the head, the eyes and the world are not part."""

    def __init__(
        self, config: ExperimentConfig, learner: TrainablePredictor, rng: np.random.Generator
    ) -> None:
        self._config = config
        self._cycle = AttentionCycle(config.cycle, Gating(config.gating), rng)
        self._limits = JointLimits(config.limits)
        self._online_learner = OnlineLearner(
            learner,
            config.look_around,
            config.evaluator,
            config.cycle.still_below_rad_s,
            seed=0,
            taught=config.task.taught,
        )

    def step(
        self,
        detections: list[Detection],
        face: NDArray[np.uint8] | None,
        posture: Posture,
        gaze: FaceGaze | None = None,
    ) -> Step:
        """Process one image: its detections, and the picture of the attended `face`, or None.

        `face`: uint8 (30, 25); `gaze`: as in `Look`.
        """
        proposal, fixation = self._online_learner.step(detections, face, posture, gaze)
        percept = CycleInput(
            posture,
            face_delta=self._feedback(caregiver_face(detections)),
            vf_delta=self._feedback(most_salient(detections)),
            lm_delta=proposal.delta,
            glance_delta=proposal.glance,
            fixation=fixation,
            log_evidence=proposal.log_evidence,
            expected_gain=proposal.expected_gain,
        )
        decision = self._cycle.step(percept)
        return Step(self._limits.clip(decision.target), decision, fixation, proposal.delta)

    def _feedback(self, seen: Detection | None) -> NDArray[np.float64] | None:
        gain = self._config.visual_feedback.gain
        return None if seen is None else visual_feedback(seen.ray, gain)
