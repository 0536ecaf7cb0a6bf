"""Draw Figure 7: the camera images while the trained network turns the head, shift by shift."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from ja_common.core.geometry import rays_of_directions
from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.rendered import RenderedStep
from ja_experiments.paper.episodes import Episode
from ja_experiments.paper.figures import BLUE, ORANGE, new_figure


def image_strips(episodes: list[Episode], config: ExperimentConfig) -> Figure:
    """Draw one row of camera images per episode, as in Figure 7."""
    columns = max(episode.shifts for episode in episodes) + 1
    figure = new_figure(2.1 * columns, 1.7 * len(episodes) + 0.5)
    panels = figure.subplots(len(episodes), columns, squeeze=False)
    for row, episode in zip(panels, episodes, strict=True):
        face = episode.frames[0].percept.face_image
        for index, axes in enumerate(row):
            axes.axis('off')
            if index < len(episode.frames):
                _draw(axes, episode.frames[index], face, config)
                turned = 'look at the caregiver' if index == 0 else f'after shift {index}'
                axes.set_title(turned, fontsize=7)
    figure.supxlabel(
        'inset: the face that the network sees, and on it its answer (pan, tilt) as a line; '
        'circle: gazing area (d_th); cross: the object that the caregiver attends to',
        fontsize=7,
    )
    return figure


def _draw(
    axes: Axes, frame: RenderedStep, face: np.ndarray | None, config: ExperimentConfig
) -> None:
    height, width = frame.image.shape[:2]
    axes.imshow(frame.image)
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    camera, truth = frame.camera, frame.truth
    radius = np.tan(config.evaluator.d_th_rad) * camera.fx
    for colour, thickness in (('black', 2.4), ('white', 1.2)):
        middle = (camera.cx, camera.cy)
        axes.add_patch(Circle(middle, radius, fill=False, color=colour, linewidth=thickness))
    ray = rays_of_directions(frame.posture.position, truth.directions[truth.attended])
    u, v = camera.pixels(ray)
    axes.plot(u, v, '+', color='white', markersize=11, markeredgewidth=2.6)
    axes.plot(u, v, '+', color=BLUE, markersize=10, markeredgewidth=1.4)
    if face is not None and frame.step.lm_delta is not None:
        _draw_face(axes, frame, face, config)


def _draw_face(
    axes: Axes, frame: RenderedStep, face: np.ndarray, config: ExperimentConfig
) -> None:
    """Draw the input of the network in the corner, and its output as a line from its middle."""
    rows, columns = face.shape
    scale = 0.36 * frame.image.shape[0] / rows
    inset = (4, 4 + columns * scale, 4 + rows * scale, 4)
    axes.imshow(face, cmap='gray', vmin=0, vmax=255, extent=inset, zorder=2)
    axes.add_patch(
        Rectangle((4, 4), columns * scale, rows * scale, fill=False, color=ORANGE, zorder=3)
    )
    centre = np.array([4 + columns * scale / 2, 4 + rows * scale / 2])
    assert frame.step.lm_delta is not None
    # In image coordinates: positive pan turns left, positive tilt turns down.
    answer = frame.step.lm_delta * (-1, 1) / config.network.angle_scale_rad
    end = centre + answer * columns * scale
    axes.plot(*np.stack([centre, end], axis=1), color=ORANGE, linewidth=2.0, zorder=4)
    axes.plot(*centre, 'o', color=ORANGE, markersize=3, zorder=4)
