"""Draw the figures of the report: Figures 6 (a) to (c) of the paper, and further ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ja_common.core.statistics import band_over_seeds, over_seeds
from ja_control.core.gating import Gating
from ja_experiments.paper.experiment import BLOCKS, STAGES, Condition

# The colours of Okabe and Ito, which colour-blind people can tell apart.
BLUE, ORANGE, GREEN, PURPLE, SKY, GREY = (
    '#0072B2', '#D55E00', '#009E73', '#CC79A7', '#56B4E9', '#666666',
)  # fmt: skip
_BY_OBJECTS = {1: (BLUE, 'o'), 3: (GREEN, 's'), 5: (ORANGE, '^'), 10: (PURPLE, 'D')}
_TRIALS_LABEL = 'learning time step [×10⁴ trials]'
PICTURE_DPI = 160


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure, size in inches, that needs no window system."""
    figure = Figure(figsize=(width, height), layout='constrained', dpi=PICTURE_DPI)
    FigureCanvasAgg(figure)
    return figure


def gating_function(conditions: Mapping[str, Condition]) -> Figure:
    """Draw Figure 6 (a): p(LM) over trials, for each reading."""
    figure = new_figure(5.0, 2.6)
    axes = figure.add_subplot()
    for (name, condition), colour in zip(conditions.items(), (BLUE, ORANGE), strict=False):
        gating = Gating(condition.plan.scale_gate(condition.config).gating)
        trials = np.linspace(0, condition.plan.trials, 301)
        p_lm = [gating.p_lm(int(trial)) for trial in trials]
        axes.plot(_ten_thousands(trials), p_lm, color=colour, label=f'pairs: {name}')
    axes.set(xlabel=_TRIALS_LABEL, ylabel='selecting rate of LM', ylim=(-0.02, 1.02))
    _over_trials(axes, next(iter(conditions.values())))
    axes.legend(frameon=False)
    return figure


def success_over_time(by_objects: Mapping[str, Mapping[int, Condition]]) -> Figure:
    """Draw Figure 6 (b): online success for the object counts, a panel for each reading."""
    figure = new_figure(9.0, 3.8)
    panels = figure.subplots(1, len(by_objects), sharey=True, squeeze=False)[0]
    for axes, (name, conditions) in zip(panels, by_objects.items(), strict=True):
        for objects, condition in conditions.items():
            colour, marker = _BY_OBJECTS[objects]
            _band(axes, condition.curve, condition, colour, marker, f'{objects}')
            axes.axhline(1 / objects, color=colour, linewidth=0.6, linestyle=':')
        _mark_stages(axes, condition)
        axes.set(xlabel=_TRIALS_LABEL, ylim=(0, 1.02))
        axes.set_title(f'pairs: {name}', pad=12)
        _over_trials(axes, condition)
    panels[0].set_ylabel('success rate of joint attention')
    panels[-1].legend(title='objects', frameon=False, loc='lower right', ncols=2)
    return figure


def attended_pan(condition: Condition, every: int = 50) -> Figure:
    """Draw Figure 6 (c): pan of the fixated object at the three stages, for the first seed."""
    figure = new_figure(9.0, 3.6)
    panels = figure.subplots(1, len(STAGES), sharey=True)
    online, size = condition.runs[0].online, condition.plan.block
    half_view = np.degrees(condition.config.task.view_pan_rad)
    for axes, (stage, block) in zip(panels, STAGES.items(), strict=True):
        chosen = np.arange(block * size, (block + 1) * size, every)
        pan, success = np.degrees(online.pan_rad[chosen]), online.success[chosen]
        trials = _ten_thousands(chosen)
        axes.axhspan(-half_view, half_view, color=SKY, alpha=0.18, linewidth=0)
        axes.scatter(
            trials[success], pan[success], s=18, facecolors='none', edgecolors=BLUE,
            linewidths=0.9, label='success',
        )  # fmt: skip
        axes.scatter(
            trials[~success], pan[~success], s=16, marker='x', color=ORANGE, linewidths=0.9,
            label='failure',
        )  # fmt: skip
        whole = online[block * size : (block + 1) * size]
        beyond = np.abs(np.degrees(whole.pan_rad)) > half_view
        axes.set_title(
            f'({stage}) success {whole.success.mean():.2f}, out of view {beyond.mean():.0%}',
            fontsize=9,
        )  # fmt: skip
        axes.set(xlabel=_TRIALS_LABEL, ylim=(-48, 48), yticks=range(-40, 41, 20))
        _clean(axes)
    panels[0].set_ylabel('pan at the attended object [deg]')
    panels[0].annotate(
        "shaded: inside the robot's first view", (0.03, 0.03), xycoords='axes fraction',
        fontsize=7, color=BLUE,
    )  # fmt: skip
    panels[-1].legend(frameon=True, loc='upper right', fontsize=8, ncols=2)
    return figure


def pan_and_tilt(conditions: Mapping[str, Condition]) -> Figure:
    """Draw the explained variance of the right pan and tilt, on pool and fresh looks."""
    figure = new_figure(9.0, 3.2)
    panels = figure.subplots(1, len(conditions), sharey=True, squeeze=False)[0]
    for axes, (name, condition) in zip(panels, conditions.items(), strict=True):
        for axis, (label, colour, marker) in enumerate(
            (('pan', BLUE, 'o'), ('tilt', ORANGE, 's'))
        ):
            for looks, style in enumerate(('-', '--')):
                known = np.array([run.explained[:, looks, axis] for run in condition.runs])
                kind = ('pool', 'fresh')[looks]
                _band(axes, known, condition, colour, marker, f'{label}, {kind}', style)
        _mark_stages(axes, condition)
        axes.set(xlabel=_TRIALS_LABEL, ylim=(-0.1, 1.02))
        axes.set_title(f'pairs: {name}', pad=12)
        _over_trials(axes, condition)
    panels[0].set_ylabel('explained variance of\nthe right command')
    panels[-1].legend(frameon=False, fontsize=8, loc='lower right')
    return figure


def ablation_bars(variants: Mapping[str, Condition], title: str) -> Figure:
    """Draw success at the end for every variant; the first is the one that the others change."""
    figure = new_figure(7.5, 1.1 + 0.24 * len(variants))
    axes = figure.add_subplot()
    rows = np.arange(len(variants))
    measures = (
        ('online', [c.online(-1) for c in variants.values()]),
        ('learner alone, pool', [c.alone('end', 'pool') for c in variants.values()]),
        ('learner alone, fresh looks', [c.alone('end', 'fresh') for c in variants.values()]),
    )
    for (label, shares), colour, marker, shift in zip(
        measures, (GREEN, BLUE, ORANGE), ('s', 'o', 'D'), (-0.22, 0.0, 0.22), strict=True
    ):
        found = [over_seeds(share) for share in shares]
        mean = np.array([e.mean for e in found])
        errors = [mean - [e.low for e in found], [e.high for e in found] - mean]
        axes.errorbar(
            mean, rows + shift, xerr=errors, fmt=marker, color=colour, markersize=3.5,
            elinewidth=0.9, label=label,
        )  # fmt: skip
        axes.axvline(mean[0], color=colour, linewidth=0.7, linestyle='--', alpha=0.6)
    axes.set_yticks(rows, list(variants), fontsize=8)
    axes.set(xlim=(0, 1.02), ylim=(len(variants) - 0.5, -0.5))
    axes.set_xlabel('success at the end (mean and 95 % interval over seeds)')
    axes.set_title(title, fontsize=10)
    _clean(axes)
    figure.legend(frameon=False, fontsize=8, loc='outside upper center', ncols=3)
    return figure


def frozen_stages(conditions: Mapping[str, Condition]) -> Figure:
    """Draw success of the learner alone after every stage, on objects in and out of view."""
    figure = new_figure(9.0, 3.0)
    panels = figure.subplots(1, len(conditions), sharey=True, squeeze=False)[0]
    places = np.arange(len(STAGES))
    bars = [
        (looks, in_view, colour, hatch)
        for looks, hatch in (('pool', ''), ('fresh', '///'))
        for in_view, colour in ((True, SKY), (False, ORANGE))
    ]
    for axes, (name, condition) in zip(panels, conditions.items(), strict=True):
        for offset, (looks, in_view, colour, hatch) in enumerate(bars):
            found = [over_seeds(condition.alone(s, looks, in_view)) for s in STAGES]
            mean = np.array([e.mean for e in found])
            errors = [mean - [e.low for e in found], [e.high for e in found] - mean]
            axes.bar(
                places + 0.2 * (offset - 1.5), mean, 0.2, yerr=errors, color=colour, hatch=hatch,
                edgecolor='white', error_kw={'elinewidth': 0.8},
                label=f'{"in" if in_view else "out of"} view, {looks}',
            )  # fmt: skip
        axes.set_xticks(places, [f'after stage {stage}' for stage in STAGES])
        axes.set(title=f'pairs: {name}', ylim=(0, 1.02))
        _clean(axes)
    panels[0].set_ylabel('success, learner alone')
    handles = panels[0].get_legend_handles_labels()
    figure.legend(*handles, frameon=False, fontsize=8, loc='outside lower center', ncols=4)
    return figure


def _band(
    axes: Axes,
    shares: NDArray[np.float64],
    condition: Condition,
    colour: str,
    marker: str,
    label: str,
    style: str = '-',
) -> None:
    """Draw a line through the middles of the blocks, with its 95 % interval over seeds."""
    mean, low, high = band_over_seeds(shares)
    middles = _ten_thousands((np.arange(BLOCKS) + 0.5) * condition.plan.block)
    axes.plot(
        middles, mean, style, color=colour, marker=marker, markersize=3, linewidth=1.2,
        label=label, markevery=2,
    )  # fmt: skip
    axes.fill_between(middles, low, high, color=colour, alpha=0.2, linewidth=0)


def _mark_stages(axes: Axes, condition: Condition) -> None:
    for stage, block in STAGES.items():
        first, last = _ten_thousands(np.array([block, block + 1]) * condition.plan.block)
        axes.axvspan(first, last, color=GREY, alpha=0.15, linewidth=0)
        axes.annotate(
            f'({stage})', ((first + last) / 2, 1.0), xycoords=('data', 'axes fraction'),
            ha='center', va='bottom', fontsize=7, color=GREY,
        )  # fmt: skip


def _over_trials(axes: Axes, condition: Condition) -> None:
    axes.set_xlim(0, float(_ten_thousands(condition.plan.trials)))
    _clean(axes)


def _clean(axes: Axes) -> None:
    axes.spines[['top', 'right']].set_visible(False)
    axes.grid(alpha=0.25, linewidth=0.5)
    axes.set_axisbelow(True)


def _ten_thousands(trials: NDArray | Sequence[float] | float) -> NDArray[np.float64]:
    return np.asarray(trials) / 1e4
