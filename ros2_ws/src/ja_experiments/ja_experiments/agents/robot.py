"""The robot without ROS: the cores of the graph's nodes, called in the order of its messages."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.detection import Detection, caregiver_face, most_salient, objects
from ja_common.core.posture import Posture
from ja_control.core.attention_cycle import AttentionCycle, CycleInput, Decision
from ja_control.core.gating import Gating
from ja_control.core.joint_limits import JointLimits
from ja_control.core.visual_feedback import visual_feedback
from ja_experiments.config import ExperimentConfig
from ja_learning.core.evaluator import EvaluatorConfig, InternalEvaluator
from ja_learning.core.learner import Predictor
from ja_learning.core.learning_module import LearningModule, Proposal
from ja_learning.core.look_around import LookAroundConfig
from ja_learning.core.trial import Trial


class Learner(Predictor, Protocol):
    """What the robot asks of its learner."""

    def learn(self, trial: Trial) -> None:
        """Learn from one trial."""


class FixedTurn:
    """In the learner's place: wherever the head is, and whatever the face, the same turn."""

    log_evidence = 0.0

    def __init__(self, turn: ArrayLike) -> None:
        self._turn = np.array(turn, float)

    def propose(
        self, face: ArrayLike, face_at: ArrayLike, posture: ArrayLike, candidates: ArrayLike
    ) -> NDArray[np.float64]:
        return self._turn

    def belief(
        self, face: ArrayLike, face_at: ArrayLike, rng: np.random.Generator, count: int
    ) -> NDArray[np.float64]:
        return np.tile(np.asarray(face_at, float) + self._turn, (count, 1))

    def log_density(
        self, faces: ArrayLike, face_at: ArrayLike, directions: ArrayLike
    ) -> NDArray[np.float64]:
        return np.zeros((len(np.asarray(faces)), len(np.asarray(directions))))

    def learn(self, trial: Trial) -> None:
        pass


class OnlineLearner:
    """A learner that lives: asked on every image, and taught the trials that it makes of them.

    `taught`: as in `TaskConfig`.
    """

    def __init__(
        self,
        learner: Learner,
        look_around: LookAroundConfig,
        evaluator: EvaluatorConfig,
        still_below_rad_s: float,
        seed: int,
        taught: str = 'fixation',
    ) -> None:
        self._learner = learner
        self._evaluator = InternalEvaluator(evaluator)
        self._module = LearningModule(lambda: learner, look_around, still_below_rad_s, seed)
        self._taught = taught

    def live(
        self, detections: list[Detection], face: NDArray[np.uint8] | None, posture: Posture
    ) -> tuple[Proposal, NDArray[np.float64] | None]:
        """One image: what the learner proposes, and the direction (2,) [rad] that is fixated."""
        rays = [seen.ray for seen in objects(detections)]
        hers = caregiver_face(detections)
        attended = None if face is None or hers is None else (face, hers.ray)
        proposal = self._module.see(posture, np.reshape(rays, (-1, 2)), attended)
        fixation = self._evaluator.fixation(detections, posture)
        if proposal.given_up is not None:
            self._learner.learn(proposal.given_up)
        trial = None if fixation is None else self._module.fixate(posture, fixation)
        if trial is not None:
            if self._taught == 'executed':
                trial = replace(trial, fixation=posture.position)
            self._learner.learn(trial)
        return proposal, fixation


@dataclass(frozen=True)
class Step:
    """What the robot made of one image.

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
        self, config: ExperimentConfig, learner: Learner, rng: np.random.Generator
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
        self, detections: list[Detection], face: NDArray[np.uint8] | None, posture: Posture
    ) -> Step:
        """One image, as detections and the picture of the attended `face`, uint8 (30, 25)."""
        proposal, fixation = self._online_learner.live(detections, face, posture)
        percept = CycleInput(
            posture,
            face_delta=self._feedback(caregiver_face(detections)),
            vf_delta=self._feedback(most_salient(detections)),
            lm_delta=proposal.delta,
            glance_delta=proposal.glance,
            fixation=fixation,
            log_evidence=proposal.log_evidence,
        )
        decision = self._cycle.step(percept)
        return Step(self._limits.clip(decision.target), decision, fixation, proposal.delta)

    def _feedback(self, seen: Detection | None) -> NDArray[np.float64] | None:
        gain = self._config.visual_feedback.gain
        return None if seen is None else visual_feedback(seen.ray, gain)
