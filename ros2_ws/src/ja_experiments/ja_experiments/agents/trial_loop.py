"""One robot in the simulated task: trial after trial, through the cores of the nodes.

One image at a time, with any learner, any gate and any way of looking around.
"""

from __future__ import annotations

import numpy as np

from ja_common.core.geometry import angle_between
from ja_common.core.posture import Posture
from ja_common.core.stamps import NS_PER_S
from ja_control.core.attention_cycle import Phase
from ja_experiments.agents.robot import Robot
from ja_experiments.config import IMAGE_PERIOD_S, ExperimentConfig
from ja_experiments.datasets.looks import Looks
from ja_experiments.paper.outcomes import Outcomes
from ja_experiments.paper.task import ATTENDED, Setting, SimulatedTask
from ja_learning.core.learner import TrainablePredictor
from ja_sim.core.specs import ObjectsSpec

_OF_A_TRIAL = (Phase.GLANCE, Phase.SHIFT)


class TrialLoop:
    """One robot, from initial weights on.

    `p_lm`: of every trial so far, the probability with which the gate followed the learner.
    `images`: how many were taken.
    """

    def __init__(
        self,
        config: ExperimentConfig,
        places: ObjectsSpec,
        looks: Looks,
        learner: TrainablePredictor,
        seed: int,
    ) -> None:
        self._rng = np.random.default_rng(seed)
        self._config, self._places = config, places
        self._robot = Robot(config, learner, self._rng)
        self._stamp_ns = 0
        self.p_lm: list[float] = []
        self.images = 0
        self.move_to(looks)

    def move_to(self, looks: Looks) -> None:
        """Change the world to that of other looks: another caregiver, or another camera."""
        config = self._config
        self._looks = looks
        self._task = SimulatedTask(config.task, config.interest, self._places, looks)

    def run(self, trials: int) -> Outcomes:
        """Run the next so many trials, and return their outcomes."""
        outcomes = Outcomes.blank(trials)
        for trial in range(trials):
            self._run_trial(self._task.draw_setting(self._rng), outcomes, trial)
        return outcomes

    def _run_trial(self, setting: Setting, outcomes: Outcomes, trial: int) -> None:
        look = self._looks.postures[setting.look]
        face = self._looks.faces[setting.look]
        outcomes.in_view[trial] = self._task.in_view(look, setting.directions[ATTENDED])
        step = self._robot.step(self._task.detections(setting, look), face, self._at_rest(look))
        while step.decision.phase in _OF_A_TRIAL:
            outcomes.shifts[trial] = step.decision.shifts + 1
            posture = step.command
            detections = self._task.detections(setting, posture)
            step = self._robot.step(detections, None, self._at_rest(posture))
        self.p_lm.append(step.decision.p_lm)
        if step.fixation is not None:
            distances = angle_between(setting.directions, step.fixation)
            outcomes.fixated[trial] = np.argmin(distances)
            outcomes.pan_rad[trial] = step.fixation[0] - look[0]

    def _at_rest(self, posture: np.ndarray) -> Posture:
        self.images += 1
        self._stamp_ns += round(IMAGE_PERIOD_S * NS_PER_S)
        return Posture(self._stamp_ns, posture, np.zeros(2))
