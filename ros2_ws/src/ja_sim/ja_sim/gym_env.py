"""The world as a Gymnasium environment, for learners of other projects.

    import gymnasium
    env = gymnasium.make('ja_sim.gym_env:JointAttention-v0', scene='easy')

(Gymnasium 1 finds no environments by itself: it imports the module before the colon. After that
`JointAttention-v0` alone is enough.)

An episode is one trial. It begins when the caregiver has turned to an object; each action shifts
the head; it ends when an object stands in the centre. The reward is 1 if that is the object she
attends to: a score for benchmarks. The robot of this project learns without it.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from ja_common.core.fixation import WIDTH_SIXTH, nearest_to_centre
from ja_common.core.geometry import rays_of_directions
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld, WorldTruth

ENV_ID = 'JointAttention-v0'
SHIFT_S = 0.1
SETTLING_STEPS = 50


class JointAttentionEnv(gymnasium.Env):
    """Observation: ``image`` (H, W, 3) uint8 RGB and ``posture`` (2,) pan, tilt [rad].

    Action: change of posture (2,) [rad]. ``info`` holds ``trial``, the ``camera`` (fx, fy, cx, cy)
    [pixels], and at the end ``fixated`` and ``attended``, indices of objects.
    """

    metadata = {'render_modes': ['rgb_array'], 'render_fps': round(1 / SHIFT_S)}  # noqa: RUF012

    def __init__(
        self,
        scene: str = 'default',
        image_size: tuple[int, int] = (320, 240),
        max_shifts: int = 10,
        d_th_rad: float = WIDTH_SIXTH,
        render_mode: str | None = None,
    ) -> None:
        """Build the world; ``scene``: name or file; ``d_th_rad``: radius of the centre (Eq. 3)."""
        self.render_mode = render_mode
        self._world = JointAttentionWorld(load_scene(scene), seed=0, image_size=image_size)
        self._max_shifts, self._d_th_rad = max_shifts, d_th_rad
        self._shifts = 0
        width, height = image_size
        limits = self._world.limits.astype(np.float32)
        reach = np.ptp(limits, axis=1)
        self.action_space = gymnasium.spaces.Box(-reach, reach, dtype=np.float32)
        self.observation_space = gymnasium.spaces.Dict(
            image=gymnasium.spaces.Box(0, 255, (height, width, 3), np.uint8),
            # An encoder may read a little beyond the limit.
            posture=gymnasium.spaces.Box(1.2 * limits[:, 0], 1.2 * limits[:, 1], dtype=np.float32),
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Look at the caregiver and wait until she has turned; a seed starts another world."""
        super().reset(seed=seed)
        if seed is not None:
            self._world.reset(seed)
        else:
            self._look_away()
        self._look_at_caregiver()
        self._shifts = 0
        return self._observation(), self._info(self._world.truth())

    def step(
        self, action: np.ndarray
    ) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        """Shift the head by ``action`` (2,) [rad]."""
        world = self._world
        world.command(world.joint_state().position + np.asarray(action, float))
        self._settle()
        self._shifts += 1
        truth = world.truth()
        fixated = self._fixated(truth)
        info = self._info(truth)
        if fixated is not None:
            info |= {'fixated': fixated, 'attended': truth.attended}
        reward = float(fixated is not None and fixated == truth.attended)
        truncated = fixated is None and self._shifts >= self._max_shifts
        return self._observation(), reward, fixated is not None, truncated, info

    def render(self) -> np.ndarray | None:
        """Return the robot's camera image (H, W, 3); None unless `render_mode` is rgb_array."""
        return self._world.observe().image if self.render_mode == 'rgb_array' else None

    def close(self) -> None:
        """Free the graphics."""
        self._world.close()

    def _observation(self) -> dict[str, np.ndarray]:
        posture = self._world.joint_state().position.astype(np.float32)
        box = self.observation_space['posture']
        return {
            'image': self._world.observe().image,
            'posture': np.clip(posture, box.low, box.high),
        }

    def _info(self, truth: WorldTruth) -> dict[str, Any]:
        seen = self._world.observe()
        return {'trial': truth.trial, 'camera': (seen.fx, seen.fy, seen.cx, seen.cy)}

    def _fixated(self, truth: WorldTruth) -> int | None:
        rays = rays_of_directions(truth.posture, truth.directions)
        return nearest_to_centre(rays, self._d_th_rad)

    def _settle(self) -> None:
        """Step until the head rests, with any servos."""
        for _ in range(SETTLING_STEPS):
            self._world.step(SHIFT_S)
            if np.all(np.abs(self._world.joint_state().velocity) < 0.01):
                return

    def _look_away(self) -> None:
        """Turn away from her face, so that the next look counts as a new one."""
        self._world.command(np.array([0.5, 0.0]) + self._world.truth().face_direction)
        self._settle()

    def _look_at_caregiver(self) -> None:
        trial = self._world.truth().trial
        while self._world.truth().trial == trial:
            self._world.command(self._world.truth().face_direction)
            self._world.step(SHIFT_S)
        spec = self._world.scene.caregiver
        self._world.step(spec.reaction_s + spec.turn_s + SHIFT_S)


def register() -> None:
    """Register the environment with Gymnasium, once."""
    if ENV_ID not in gymnasium.registry:
        gymnasium.register(id=ENV_ID, entry_point='ja_sim.gym_env:JointAttentionEnv')


register()
