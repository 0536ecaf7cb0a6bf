"""Figure 7: what the camera sees while the trained network turns the head, shift by shift.

The pictures come from the rendered world, not from the simulated trials of the learning, and the
caregiver's looks are none of those that were learned from.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from ja_common.core.geometry import angle_between, rays_of_directions
from ja_control.core.attention_cycle import Phase
from ja_experiments.agents.robot import Robot
from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.looks import IMAGE_SIZE, POOL
from ja_experiments.datasets.rendered import DWELL_S, RenderedStep, RenderedTask
from ja_experiments.paper.experiment import LEARNER_ALONE
from ja_experiments.paper.figures import BLUE, ORANGE, new_figure
from ja_learning.core.network import ThreeLayerNetwork
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld


@dataclass(frozen=True)
class Episode:
    """One trial in the rendered world: the last image of the look, then one after every shift.

    `success`: None when nothing was fixated and the trial was given up.
    """

    sights: list[RenderedStep]
    success: bool | None

    @property
    def shifts(self) -> int:
        """How many times the head was turned."""
        return len(self.sights) - 1

    @property
    def in_view(self) -> bool:
        """Was the attended object in view of the look?"""
        return self.sights[0].truth.in_view_at_look


class Taught(ThreeLayerNetwork):
    """A trained network that no longer learns."""

    def __init__(self, network: ThreeLayerNetwork) -> None:
        super().__init__(network.config, seed=0)
        self.restore(network.state())

    def learn(self, trial: object) -> None:
        """Nothing more."""


def watch(
    config: ExperimentConfig,
    network: ThreeLayerNetwork,
    scene: str,
    seed: int,
    trials: int,
    progress: Callable[[int], None] = lambda more: None,
) -> list[Episode]:
    """So many trials of the learner alone with the caregiver of the looks of this seed."""
    config = config.with_settings({**LEARNER_ALONE, 'dwell_s': DWELL_S})
    world = JointAttentionWorld(load_scene(scene), seed, IMAGE_SIZE)
    try:
        _leave_out_the_pool(world)
        robot = Robot(config, Taught(network), np.random.default_rng(seed))
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


def _leave_out_the_pool(world: JointAttentionWorld) -> None:
    """Let the caregiver live through the looks that were learned from; no picture is taken."""
    while world.truth().trial < POOL:
        for posture in (np.array([0.35, 0.0]), world.truth().face_direction):
            world.command(posture)
            world.step(1.0)


def _next_episode(task: RenderedTask) -> Episode | None:
    """The next trial; None if the caregiver looked elsewhere meanwhile (her trial changed)."""
    sight = task.advance()
    while not _shifting(sight):
        sight = task.advance()
    sights = [sight]
    while _shifting(sight):
        before, sight = sight, task.advance()
        decided = sight.step.decision
        if not _shifting(sight) or decided.shifts > before.step.decision.shifts:
            sights.append(sight)
    if sight.truth.trial != sights[0].truth.trial:
        return None
    if sight.step.fixation is None:
        return Episode(sights, None)
    nearest = np.argmin(angle_between(sight.truth.directions, sight.step.fixation))
    return Episode(sights, bool(nearest == sight.truth.attended))


def _shifting(sight: RenderedStep) -> bool:
    return sight.step.decision.phase is Phase.SHIFT


def most_telling(episodes: list[Episode], rows: int) -> list[Episode]:
    """The successes with most shifts, those whose object was out of view first."""
    good = [episode for episode in episodes if episode.success]
    return sorted(good, key=lambda e: (e.in_view, -e.shifts))[:rows]


def image_strips(episodes: list[Episode], config: ExperimentConfig) -> Figure:
    """A row an episode: camera image after camera image, as in Figure 7."""
    columns = max(episode.shifts for episode in episodes) + 1
    figure = new_figure(2.1 * columns, 1.7 * len(episodes) + 0.5)
    panels = figure.subplots(len(episodes), columns, squeeze=False)
    for row, episode in zip(panels, episodes, strict=True):
        face = episode.sights[0].percept.face_image
        for index, axes in enumerate(row):
            axes.axis('off')
            if index < len(episode.sights):
                _draw(axes, episode.sights[index], face, config)
                turned = 'look at the caregiver' if index == 0 else f'after shift {index}'
                axes.set_title(turned, fontsize=7)
    figure.supxlabel(
        'inset: the face that the network sees, and on it its answer (pan, tilt) as a line; '
        'circle: gazing area (d_th); cross: the object that the caregiver attends to',
        fontsize=7,
    )
    return figure


def _draw(
    axes: Axes, sight: RenderedStep, face: np.ndarray | None, config: ExperimentConfig
) -> None:
    height, width = sight.image.shape[:2]
    axes.imshow(sight.image)
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    camera, truth = sight.camera, sight.truth
    radius = np.tan(config.evaluator.d_th_rad) * camera.fx
    for colour, thickness in (('black', 2.4), ('white', 1.2)):
        middle = (camera.cx, camera.cy)
        axes.add_patch(Circle(middle, radius, fill=False, color=colour, linewidth=thickness))
    ray = rays_of_directions(sight.posture.position, truth.directions[truth.attended])
    u, v = camera.pixels(ray)
    axes.plot(u, v, '+', color='white', markersize=11, markeredgewidth=2.6)
    axes.plot(u, v, '+', color=BLUE, markersize=10, markeredgewidth=1.4)
    if face is not None and sight.step.lm_delta is not None:
        _draw_face(axes, sight, face, config)


def _draw_face(
    axes: Axes, sight: RenderedStep, face: np.ndarray, config: ExperimentConfig
) -> None:
    """The network's input in the corner, and its output as a line from the middle of it."""
    rows, columns = face.shape
    scale = 0.36 * sight.image.shape[0] / rows
    inset = (4, 4 + columns * scale, 4 + rows * scale, 4)
    axes.imshow(face, cmap='gray', vmin=0, vmax=255, extent=inset, zorder=2)
    axes.add_patch(
        Rectangle((4, 4), columns * scale, rows * scale, fill=False, color=ORANGE, zorder=3)
    )
    centre = np.array([4 + columns * scale / 2, 4 + rows * scale / 2])
    assert sight.step.lm_delta is not None
    # As the camera would see it: what lies left needs positive pan, what lies below positive tilt.
    answer = sight.step.lm_delta * (-1, 1) / config.network.angle_scale_rad
    end = centre + answer * columns * scale
    axes.plot(*np.stack([centre, end], axis=1), color=ORANGE, linewidth=2.0, zorder=4)
    axes.plot(*centre, 'o', color=ORANGE, markersize=3, zorder=4)
