"""The tasks as Gymnasium environments.

    import gymnasium
    env = gymnasium.make(
        'ja_experiments.learning_tasks.trial_env:JointAttention/FiveObjects-v0',
        caregiver=3, track='landmarks with depth',
    )

(Gymnasium finds no environments by itself: it imports the module before the colon.)

An episode is one trial with one action. The faces are rendered before, once for each caregiver, so
that a step takes a fraction of a millisecond.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import gymnasium
import numpy as np

from ja_common.core.config import ConfigError
from ja_experiments.learning_tasks.drawn_trials import (
    DrawnTrial,
    Observation,
    TrialSource,
    nearest_object,
)
from ja_experiments.learning_tasks.stage_looks import LooksSource, rendered_looks, stage_looks
from ja_experiments.learning_tasks.task_table import TASKS, find_task
from ja_learning.core.track import Track

REACH_RAD = (math.pi / 4, math.pi / 8)
"""Largest change of pan and of tilt."""


class TrialEnv(gymnasium.Env):
    """Observation: as in `observation_space`. Action: a change of posture (2,) [rad].

    The reward is 1 if the object nearest to the aim is the attended object, else 0. `info` holds
    `trial`, the number of trials that ended, and after an action `fixated`, the index of the
    object nearest to the aim. It never holds the truth.
    """

    metadata: ClassVar[dict[str, Any]] = {'render_modes': []}

    def __init__(
        self,
        task: str = 'five-objects',
        caregiver: int = 0,
        track: str = 'strict',
        rewarded: bool = True,
        trials_scale: int = 1,
        source: LooksSource = rendered_looks,
        render_mode: str | None = None,
    ) -> None:
        """Load the looks; without cached ones this takes minutes.

        `caregiver`: her seed. `track`: which senses are on, see `ja_learning.core.track`.
        `rewarded`: without it the reward is always 0. `trials_scale`: a change comes after so many
        times more trials. Raises ConfigError for a task or a track that does not exist.
        """
        self.task = find_task(task)
        self.render_mode = render_mode
        self.trials = 0
        """Trials that have ended since the last reset with a seed."""
        try:
            self._source = TrialSource(self.task, Track.parse(track))
        except ValueError as error:
            raise ConfigError(str(error)) from None
        self._practice = [each.practice for each in stage_looks(self.task, caregiver, source)]
        self._change_at = self.task.marks[-1] * trials_scale
        self._rewarded = rewarded
        self._trial: DrawnTrial | None = None
        self.observation_space = self._source.space
        reach = np.array(REACH_RAD, np.float32)
        self.action_space = gymnasium.spaces.Box(-reach, reach, dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin the next trial; a seed begins again at the first one."""
        super().reset(seed=seed)
        if seed is not None:
            self.trials = 0
        changed = len(self._practice) > 1 and self.trials >= self._change_at
        looks = self._practice[changed]
        index = (self.trials - self._change_at * changed) % len(looks)
        self._trial = self._source.draw_trial(self.np_random, looks, index, self.task.reliability)
        return self._trial.observation, {'trial': self.trials}

    def step(self, action: np.ndarray) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Turn the head by `action` (2,) [rad]: the trial ends. Raises RuntimeError after it."""
        if self._trial is None:
            raise RuntimeError('the trial has ended: reset() begins the next one')
        observation, attended = self._trial
        fixated = nearest_object(observation, action)
        self._trial = None
        self.trials += 1
        reward = float(self._rewarded and fixated == attended)
        # New arrays: those of the reset may still be in use.
        observation = {name: values.copy() for name, values in observation.items()}
        return observation, reward, True, False, {'trial': self.trials, 'fixated': fixated}


def register() -> None:
    """Register the tasks with Gymnasium, once."""
    for task in TASKS.values():
        if task.environment not in gymnasium.registry:
            gymnasium.register(
                id=task.environment,
                entry_point=f'{__name__}:TrialEnv',
                kwargs={'task': task.name},
            )


register()
