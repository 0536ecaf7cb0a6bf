"""Watching the caregiver: all pictures of every look at her, and what stood around her.

As in `looks`, the robot looks at her, waits for her gaze, looks aside, and looks again. But each
picture of her face is kept, from the first of a look on, and no label is: which object she attends
to is not returned. So this is what a learner may have before its first trial on the tracks
`self-supervised` and `synthetic others` (docs/tracks.md).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ja_common.core.detection import caregiver_face
from ja_common.core.geometry import directions_of_rays
from ja_control.core.attention_cycle import Phase
from ja_experiments.agents.robot import FixedTurn, Robot
from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.looks import IMAGE_SIZE
from ja_experiments.datasets.rendered import DWELL_S, IMAGE_PERIOD_S, RenderedTask
from ja_learning.core.trial import Look
from ja_sim.core.scene import Scene
from ja_sim.core.world import JointAttentionWorld

PICTURES_A_SECOND = 1 / IMAGE_PERIOD_S
_ASIDE_RAD = (0.35, 0.0)


class WatchedLook(NamedTuple):
    """One look at her.

    `pictures`: uint8 (n, 30, 25), in order; `look`: the last of them, as a learner has it;
    `objects`: (m, 2) [rad], directions of all objects around, in any order.
    """

    pictures: NDArray[np.uint8]
    look: Look
    objects: NDArray[np.float64]


def watch(scene: Scene, seed: int) -> Iterator[WatchedLook]:
    """Yield looks at the caregiver of this scene and seed, without end."""
    config = ExperimentConfig().with_settings(
        {'dwell_s': DWELL_S, 'max_shifts': 1, 'gating': 'constant', 'p_lm_max': 1.0}
    )
    world = JointAttentionWorld(scene, seed, IMAGE_SIZE)
    robot = Robot(config, FixedTurn(_ASIDE_RAD), np.random.default_rng(seed))
    task = RenderedTask(world, robot)
    order = np.random.default_rng(seed)
    pictures: list[NDArray[np.uint8]] = []
    trial = 0
    try:
        while True:
            sight = task.advance()
            face = caregiver_face(sight.percept.detections)
            if face is None or sight.percept.face_image is None:
                pictures.clear()
                continue
            pictures.append(sight.percept.face_image)
            if sight.step.decision.phase is not Phase.SHIFT or sight.truth.trial <= trial:
                continue
            trial = sight.truth.trial
            look = Look(pictures[-1], directions_of_rays(sight.posture.position, face.ray))
            yield WatchedLook(np.array(pictures), look, order.permutation(sight.truth.directions))
            pictures.clear()
    finally:
        world.close()
