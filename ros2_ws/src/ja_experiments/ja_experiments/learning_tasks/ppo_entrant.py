"""Proximal policy optimisation (Schulman et al. 2017) of stable-baselines3, trained on the reward.

The library is an extra of the benchmark: `requirements/ppo.in`. Nothing else needs it.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_experiments.learning_tasks.drawn_trials import Observation
from ja_experiments.learning_tasks.entrant import REWARDED
from ja_experiments.learning_tasks.trial_env import REACH_RAD, TrialEnv

LIBRARY = 'stable_baselines3'
_ROLLOUT, _BATCH = 500, 100


def check_library() -> None:
    """Raise ConfigError, with what to install, where the library is missing."""
    if find_spec(LIBRARY) is None:
        raise ConfigError(
            f'the baseline ppo needs {LIBRARY}: .venv/bin/pip install --require-hashes '
            '-r requirements/ppo.lock'
        )


class PpoEntrant:
    """A policy and a value network of 64 x 64 units, with the library's settings.

    An episode has one action, so the discount makes no difference.
    """

    track = REWARDED
    trials_scale = 100

    def __init__(self, seed: int) -> None:
        """Raise ConfigError where the library is missing."""
        check_library()
        self._library: Any = import_module(LIBRARY)
        self._seed = seed
        self._model: Any = None

    def propose(self, observation: Observation) -> NDArray:
        """Return the most probable action of the policy; before practice, none: zeros."""
        if self._model is None:
            return np.zeros(2)
        action, _ = self._model.predict(_inputs(observation), deterministic=True)
        return action * REACH_RAD

    def practise(self, env: TrialEnv, trials: int) -> None:
        """Train for so many trials, a multiple of 500."""
        if self._model is None:
            self._model = self._library.PPO(
                'MlpPolicy', _PolicyView(env), n_steps=_ROLLOUT, batch_size=_BATCH,
                seed=self._seed, device='cpu',
            )  # fmt: skip
        self._model.learn(trials, reset_num_timesteps=False)

    def __deepcopy__(self, memo: dict[int, Any]) -> PpoEntrant:
        """Return the same policy, which only `practise` changes."""
        frozen = object.__new__(PpoEntrant)
        frozen._model = self._model
        return frozen


class _PolicyView(gymnasium.Wrapper):
    """The task as a network likes it: one array of numbers near 1 in and out."""

    def __init__(self, env: TrialEnv) -> None:
        super().__init__(env)
        size = len(_inputs(env.observation_space.sample()))
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(self, **options: Any) -> tuple[NDArray, dict[str, Any]]:
        # PPO seeds the environment once more at its beginning: the scorer has done so.
        observation, info = self.env.reset(options=options.get('options'))
        return _inputs(observation), info

    def step(self, action: NDArray) -> tuple[NDArray, float, bool, bool, dict[str, Any]]:
        observation, reward, *rest = self.env.step(action * REACH_RAD)
        return _inputs(observation), reward, *rest


def _inputs(observation: Observation) -> NDArray[np.float32]:
    """Return the face, standardised, and the objects relative to it in the order of their pan."""
    face = observation['face'].ravel().astype(np.float32)
    face = (face - face.mean()) / max(float(face.std()), 1.0)
    objects = (observation['objects'] - observation['face_direction']) / REACH_RAD
    objects = objects[np.argsort(objects[:, 0])]
    return np.concatenate([face, objects.ravel()]).astype(np.float32)
