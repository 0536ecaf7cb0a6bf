"""The robot in the rendered world measures ranges with the senses that the scene gives it."""

from dataclasses import replace

import numpy as np
import pytest

from ja_common.core.detection import caregiver_face, objects
from ja_common.core.geometry import angle_between, directions_of_rays
from ja_experiments.agents.robot import FixedTurn, Robot
from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.rendered import RenderedStep, RenderedTask
from ja_sim.core.scene import load_scene
from ja_sim.core.specs import SensesSpec
from ja_sim.core.world import JointAttentionWorld


def steps(senses: SensesSpec, count: int = 12) -> list[RenderedStep]:
    world = JointAttentionWorld(replace(load_scene('default'), senses=senses), seed=1)
    robot = Robot(ExperimentConfig(), FixedTurn([0.35, 0.0]), np.random.default_rng(0))
    task = RenderedTask(world, robot)
    try:
        return [task.advance() for _ in range(count)]
    finally:
        world.close()


def errors(seen: RenderedStep) -> tuple[list[float], list[float]]:
    """Return the relative errors of the ranges of her face and of the objects."""
    truth, here = seen.truth, seen.posture.position
    face, things = caregiver_face(seen.percept.detections), []
    distances = np.linalg.norm(truth.positions, axis=1)
    for thing in objects(seen.percept.detections):
        apart = angle_between(truth.directions, directions_of_rays(here, thing.ray))
        if apart.min() < 0.02:
            things.append(thing.range_m / distances[np.argmin(apart)] - 1.0)
    own = [] if face is None else [face.range_m / np.linalg.norm(truth.face_position) - 1.0]
    return own, things


@pytest.mark.parametrize(
    ('senses', 'within'),
    [
        (SensesSpec(depth='exact'), 0.06),
        (SensesSpec(depth='sensor'), 0.08),
        (SensesSpec(second_camera=True), 0.08),
    ],
)
def test_ranges_of_face_and_objects_are_measured(senses: SensesSpec, within: float) -> None:
    found = [errors(seen) for seen in steps(senses)]
    for kind in (0, 1):
        relative = np.array([error for each in found for error in each[kind]])
        assert np.isfinite(relative).sum() >= 5
        assert np.nanmedian(np.abs(relative)) < within


def test_without_senses_no_range_is_known() -> None:
    for seen in steps(SensesSpec(), count=6):
        assert seen.percept.detections
        assert all(np.isnan(each.range_m) for each in seen.percept.detections)
