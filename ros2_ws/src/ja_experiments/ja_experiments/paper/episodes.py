"""Trials of the trained network in the rendered world, for Figure 7 and its table.

The pictures come from the rendered world, not from the simulated trials of the training. The looks
of the caregiver are none of those that were learned from.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ja_common.core.geometry import angle_between
from ja_control.core.attention_cycle import Phase
from ja_experiments.agents.robot import Robot
from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.looks import IMAGE_SIZE, POOL
from ja_experiments.datasets.rendered import DWELL_S, RenderedStep, RenderedTask
from ja_experiments.paper.experiment import LEARNER_ALONE
from ja_learning.core.network import ThreeLayerNetwork
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld


@dataclass(frozen=True)
class Episode:
    """One trial in the rendered world: the last image of the look, then one after every shift.

    `success`: None when the trial ended without a fixation.
    """

    frames: list[RenderedStep]
    success: bool | None

    @property
    def shifts(self) -> int:
        """Return the number of shifts of the head."""
        return len(self.frames) - 1

    @property
    def in_view(self) -> bool:
        """Return whether the attended object was in view of the look."""
        return self.frames[0].truth.in_view_at_look


class FrozenNetwork(ThreeLayerNetwork):
    """A trained network that no longer learns."""

    def __init__(self, network: ThreeLayerNetwork) -> None:
        super().__init__(network.config, seed=0)
        self.restore(network.state())

    def update(self, trial: object) -> None:
        """Do nothing."""


def record_episodes(
    config: ExperimentConfig,
    network: ThreeLayerNetwork,
    scene: str,
    seed: int,
    trials: int,
    progress: Callable[[int], None] = lambda more: None,
) -> list[Episode]:
    """Return trials of the learner alone with the caregiver of the looks of this seed."""
    config = config.with_settings({**LEARNER_ALONE, 'dwell_s': DWELL_S})
    world = JointAttentionWorld(load_scene(scene), seed, IMAGE_SIZE)
    try:
        _skip_the_pool(world)
        robot = Robot(config, FrozenNetwork(network), np.random.default_rng(seed))
        task = RenderedTask(world, robot)
        episodes: list[Episode] = []
        while len(episodes) < trials:
            episode = _next_episode(task)
            if episode is not None:
                episodes.append(episode)
                progress(1)
        return episodes
    finally:
        world.close()


def _skip_the_pool(world: JointAttentionWorld) -> None:
    """Advance the caregiver past the looks that were learned from, without taking pictures."""
    while world.truth().trial < POOL:
        for posture in (np.array([0.35, 0.0]), world.truth().face_direction):
            world.command(posture)
            world.step(1.0)


def _next_episode(task: RenderedTask) -> Episode | None:
    """Return the next trial; None if the caregiver began another trial meanwhile."""
    frame = task.advance()
    while not _shifting(frame):
        frame = task.advance()
    frames = [frame]
    while _shifting(frame):
        before, frame = frame, task.advance()
        decided = frame.step.decision
        if not _shifting(frame) or decided.shifts > before.step.decision.shifts:
            frames.append(frame)
    if frame.truth.trial != frames[0].truth.trial:
        return None
    if frame.step.fixation is None:
        return Episode(frames, None)
    nearest = np.argmin(angle_between(frame.truth.directions, frame.step.fixation))
    return Episode(frames, bool(nearest == frame.truth.attended))


def _shifting(frame: RenderedStep) -> bool:
    return frame.step.decision.phase is Phase.SHIFT


def choose_examples(episodes: list[Episode], rows: int) -> list[Episode]:
    """Return the successes with most shifts, those whose object was out of view first."""
    good = [episode for episode in episodes if episode.success]
    return sorted(good, key=lambda e: (e.in_view, -e.shifts))[:rows]
