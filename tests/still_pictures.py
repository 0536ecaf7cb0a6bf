"""Stills of the simulated caregiver, named as those of Columbia Gaze."""

from pathlib import Path

import cv2
import numpy as np

from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld


def write_stills(folder: Path) -> None:
    """Write 27 stills of one person, her head turned with her gaze."""
    world = JointAttentionWorld(load_scene('bare_room'), 5)
    for up in (-10, 0, 10):
        for aside in range(-20, 21, 5):
            # Her own left is positive: the robot's right.
            picture = world.render_picture(np.radians([-aside, -up]))
            cv2.imwrite(str(folder / f'0001_1.2m_0P_{up}V_{aside}H.png'), picture[..., ::-1])
    world.close()
