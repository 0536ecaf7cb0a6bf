"""The robot in the rendered world: pictures through the graph's own detector, without ROS."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.posture import Posture
from ja_experiments.agents.robot import Robot, Step
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.depth_ranges import DepthPicture
from ja_perception.core.detector import Percept, SalientFeatureDetector
from ja_perception.core.gaze_reader import GazeReader
from ja_perception.core.ranging import RangeSensor
from ja_perception.core.stereo_ranges import SecondView
from ja_sim.core.camera import Observation
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
    """A world, a detector and a robot in a loop; one `advance` processes one image.

    The robot has the senses of the world's scene: detections have ranges by the depth picture, or
    else by the second camera. With a `gaze_reader`, the robot reads landmarks too.
    """

    def __init__(
        self, world: JointAttentionWorld, robot: Robot, gaze_reader: GazeReader | None = None
    ) -> None:
        self._world, self._robot = world, robot
        self._detector = SalientFeatureDetector(BlazeFace(), gaze_reader=gaze_reader)

    def advance(self) -> RenderedStep:
        """Step the world by one image period, take a picture, and command the head."""
        self._world.step(IMAGE_PERIOD_S)
        seen, joints, truth = self._world.observe(), self._world.joint_state(), self._world.truth()
        posture = Posture(seen.stamp_ns, joints.position, joints.velocity)
        camera = CameraModel(
            seen.intrinsics.width, seen.intrinsics.height, seen.fx, seen.fy, seen.cx, seen.cy
        )
        percept = self._detector.detect(
            seen.image, seen.stamp_ns, camera, posture, self._range_sensor(seen)
        )
        step = self._robot.step(percept.detections, percept.face_image, posture, percept.face_gaze)
        self._world.command(step.command)
        return RenderedStep(seen.image, camera, percept, posture, step, truth)

    def _range_sensor(self, seen: Observation) -> RangeSensor | None:
        if seen.depth is not None:
            return DepthPicture(seen.depth)
        if seen.right is not None:
            return SecondView(seen.right, seen.fx * self._world.scene.senses.baseline_m)
        return None
