"""The experiment of section 3, one image at a time, through the very cores of the nodes.

This is the readable version; `kernel.py` computes the same, several hundred times faster.
"""

from __future__ import annotations

import numpy as np

from ja_common.core.geometry import angle_between
from ja_common.core.posture import Posture
from ja_common.core.stamps import NS_PER_S
from ja_control.core.attention_cycle import Phase
from ja_experiments.config import IMAGE_PERIOD_S, ExperimentConfig
from ja_experiments.looks import Looks
from ja_experiments.outcomes import Outcomes
from ja_experiments.robot import Robot
from ja_experiments.task import ATTENDED, Setting, SimulatedTask
from ja_learning.core.network import ThreeLayerNetwork
from ja_sim.core.specs import ObjectsSpec


class ReferenceExperiment:
    """One robot, from untaught on."""

    def __init__(
        self, config: ExperimentConfig, places: ObjectsSpec, looks: Looks, seed: int
    ) -> None:
        self.network = ThreeLayerNetwork(config.network, seed)
        self._rng = np.random.default_rng(seed)
        self._looks = looks
        self._task = SimulatedTask(config.task, config.interest, places, looks)
        self._robot = Robot(config, self.network, self._rng)
        self._stamp_ns = 0

    def run(self, trials: int) -> Outcomes:
        """The next so many trials."""
        outcomes = Outcomes.blank(trials)
        for trial in range(trials):
            self._run_trial(self._task.draw(self._rng), outcomes, trial)
        return outcomes

    def _run_trial(self, setting: Setting, outcomes: Outcomes, trial: int) -> None:
        look = self._looks.postures[setting.look]
        face = self._looks.faces[setting.look]
        outcomes.in_view[trial] = self._task.in_view(look, setting.directions[ATTENDED])
        step = self._robot.step(self._task.detections(setting, look), face, self._at_rest(look))
        while step.decision.phase is Phase.SHIFT:
            posture = step.command
            detections = self._task.detections(setting, posture)
            step = self._robot.step(detections, None, self._at_rest(posture))
            outcomes.shifts[trial] += 1
        if step.fixation is not None:
            distances = angle_between(setting.directions, step.fixation)
            outcomes.fixated[trial] = np.argmin(distances)
            outcomes.pan_rad[trial] = step.fixation[0] - look[0]

    def _at_rest(self, posture: np.ndarray) -> Posture:
        self._stamp_ns += round(IMAGE_PERIOD_S * NS_PER_S)
        return Posture(self._stamp_ns, posture, np.zeros(2))
