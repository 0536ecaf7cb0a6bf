"""The robot in the rendered world: pictures through the graph's own detector, without ROS."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.posture import Posture
from ja_experiments.agents.robot import Robot, Step
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.detector import Percept, SalientFeatureDetector
from ja_sim.core.world import JointAttentionWorld, WorldTruth

IMAGE_PERIOD_S = 0.1
DWELL_S = 0.5
"""Time [s] to look at the face: long enough for her reaction and her turn."""


@dataclass(frozen=True)
class RenderedStep:
    """One image and its processing. `truth` is for scores and figures, never for the learner."""

    image: NDArray[np.uint8]
    camera: CameraModel
    percept: Percept
    posture: Posture
    step: Step
    truth: WorldTruth


class RenderedTask:
    """A world, a detector and a robot in a loop; one `advance` processes one image."""

    def __init__(self, world: JointAttentionWorld, robot: Robot) -> None:
        self._world, self._robot = world, robot
        self._detector = SalientFeatureDetector(BlazeFace())

    def advance(self) -> RenderedStep:
        """Step the world by one image period, take a picture, and command the head."""
        self._world.step(IMAGE_PERIOD_S)
        seen, joints, truth = self._world.observe(), self._world.joint_state(), self._world.truth()
        posture = Posture(seen.stamp_ns, joints.position, joints.velocity)
        camera = CameraModel(
            seen.intrinsics.width, seen.intrinsics.height, seen.fx, seen.fy, seen.cx, seen.cy
        )
        percept = self._detector.detect(seen.image, seen.stamp_ns, camera, posture)
        step = self._robot.step(percept.detections, percept.face_image, posture)
        self._world.command(step.command)
        return RenderedStep(seen.image, camera, percept, posture, step, truth)
