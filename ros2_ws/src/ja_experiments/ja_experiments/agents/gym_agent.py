"""Any learner of this project in the Gymnasium world, with perception and pipeline around it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import most_salient
from ja_common.core.posture import STILL_BELOW_RAD_S, Posture
from ja_common.core.stamps import NS_PER_S
from ja_control.core.visual_feedback import visual_feedback
from ja_experiments.agents.robot import OnlineLearner
from ja_learning.core.evaluator import EvaluatorConfig
from ja_learning.core.learner import TrainablePredictor
from ja_learning.core.look_around import LookAroundConfig
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.detector import SalientFeatureDetector


class GymAgent:
    """An agent for `JointAttention-v0` around any learner; it never sees the reward.

    `p_lm`: how often it follows the learner; else it turns to what is most salient (Eq. 2).
    """

    def __init__(self, learner: TrainablePredictor, p_lm: float, seed: int) -> None:
        self.p_lm = p_lm
        self._rng = np.random.default_rng(seed)
        self._detector = SalientFeatureDetector(BlazeFace())
        self._online_learner = OnlineLearner(
            learner, LookAroundConfig(), EvaluatorConfig(), STILL_BELOW_RAD_S, seed
        )
        self._stamp_ns = 0

    def act(self, observation: dict[str, NDArray], info: dict[str, Any]) -> NDArray[np.float64]:
        """Return a change of posture (2,) [rad]; learn from the trials that end meanwhile."""
        # The observation is taken at rest, one second after the other: there is no ego-motion.
        self._stamp_ns += NS_PER_S
        posture = Posture(self._stamp_ns, observation['posture'].astype(float), np.zeros(2))
        image = observation['image']
        camera = CameraModel(image.shape[1], image.shape[0], *info['camera'])
        percept = self._detector.detect(image, self._stamp_ns, camera, posture)
        proposal, _ = self._online_learner.step(percept.detections, percept.face_image, posture)
        if proposal.delta is not None and self._rng.random() < self.p_lm:
            return proposal.delta
        salient = most_salient(percept.detections)
        return np.zeros(2) if salient is None else visual_feedback(salient.ray, 1.0)
