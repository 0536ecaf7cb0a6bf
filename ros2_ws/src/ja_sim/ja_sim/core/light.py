"""The light in the room, drawn at random at each reset."""

from __future__ import annotations

import math

import mujoco
import numpy as np

MAX_TURN_RAD = math.radians(40.0)
MAX_DIMMING = 0.35


class Lighting:
    """Varies every lamp's strength and direction around those of the room's file."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._diffuse = model.light_diffuse.copy()
        self._direction = model.light_dir.copy()
        self._ambient = model.vis.headlight.ambient.copy()

    def randomise(self, amount: float, rng: np.random.Generator) -> None:
        """Draw a lighting; ``amount`` from 0 (as in the file) to 1 (as different as it gets)."""
        model = self._model
        for lamp in range(model.nlight):
            model.light_diffuse[lamp] = self._diffuse[lamp] * _strength(amount, rng)
            turn = amount * rng.uniform(-MAX_TURN_RAD, MAX_TURN_RAD)
            rotation = np.array(
                [
                    [math.cos(turn), -math.sin(turn), 0.0],
                    [math.sin(turn), math.cos(turn), 0.0],
                    [0.0, 0.0, 1.0],
                ]
            )
            model.light_dir[lamp] = rotation @ self._direction[lamp]
        model.vis.headlight.ambient[:] = self._ambient * _strength(amount, rng)


def _strength(amount: float, rng: np.random.Generator) -> float:
    return 1.0 + amount * float(rng.uniform(-MAX_DIMMING, MAX_DIMMING))
