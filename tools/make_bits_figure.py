"""Make docs/images/learner/bits-a-trial.png from the figures of a benchmark.

./ja bench bits_a_trial --json bits.json
.venv/bin/python tools/make_bits_figure.py bits.json
"""

import json
import re
import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from ja_benchmarks.rows import Row
from ja_experiments.paper.figures import BLUE, GREEN, GREY, ORANGE, PURPLE, new_figure

OUTPUT = Path(__file__).parents[1] / 'docs' / 'images' / 'learner' / 'bits-a-trial.png'

# The learners in the order of the legend, by the beginning of their rows.
STYLES: dict[str, tuple[str, str]] = {
    'ideal, knows mirror images': (GREY, '--'),
    'ideal': (PURPLE, '--'),
    'landmarks with depth to 3 %': (GREEN, '-'),
    'landmarks': (ORANGE, '-'),
    'strict': (BLUE, '-'),
}
_ROW = re.compile(r'bits_a_trial/(.+), (\d+) objects: (bits|success|gain) (.*)')


def rows_of(rows: dict[str, Row], learner: str, objects: int, what: str) -> list[list[float]]:
    """Return trials and the value with its interval, (marks, 4): of gains, the last trial."""
    found = []
    for name, row in rows.items():
        match = _ROW.fullmatch(name)
        if match and match.groups()[:3] == (learner, str(objects), what):
            trials = int(re.findall(r'\d+', match[4])[-1])
            found.append([trials, row['value'], *(row['interval'] or [np.nan, np.nan])])
    return found


def draw_curves(axes: Axes, rows: dict[str, Row], objects: int, what: str) -> None:
    """Draw one measure of every learner that was measured, over trials."""
    for learner, (colour, style) in STYLES.items():
        found = np.array(rows_of(rows, learner, objects, what)).reshape(-1, 4)
        if not len(found):
            continue
        trials, value, low, high = found[found[:, 0] > 0].T
        axes.plot(trials, value, style, color=colour, marker='o', markersize=3, label=learner)
        axes.fill_between(trials, low, high, color=colour, alpha=0.15, linewidth=0)
    axes.set_xscale('log')
    axes.grid(alpha=0.25, linewidth=0.5)
    axes.spines[['top', 'right']].set_visible(False)


def mark_level(axes: Axes, level: float, text: str) -> None:
    """Mark a level that no learner can exceed."""
    axes.axhline(level, color='black', linewidth=0.8, linestyle=':')
    axes.annotate(
        text,
        (0.99, level),
        xycoords=('axes fraction', 'data'),
        fontsize=7,
        ha='right',
        va='bottom',
    )


def main() -> None:
    """Draw a row of panels for each count of objects: bits, gain a trial, success."""
    rows: dict[str, Row] = json.loads(Path(sys.argv[1]).read_text(encoding='utf-8'))
    counts = (5, 10)
    figure = new_figure(10.5, 5.6)
    panels = figure.subplots(len(counts), 3, sharex=True)
    for (bits, gain, success), objects in zip(panels, counts, strict=True):
        most, known = np.log2(objects), f'bits_a_trial/map known, {objects} objects'
        draw_curves(bits, rows, objects, 'bits')
        mark_level(bits, most, f'log2({objects})')
        mark_level(bits, rows[f'{known}: bits']['value'], 'her head known to 0.5 deg')
        bits.set(ylabel=f'{objects} objects\nbits about the gaze target', ylim=(-1.6, most + 0.3))
        draw_curves(gain, rows, objects, 'gain')
        mark_level(gain, most, f'the most a trial can tell, log2({objects})')
        gain.set_ylabel('gain since the mark before\n[bits a trial]')
        # A learner may lose bits: linear near zero.
        gain.set_yscale('symlog', linthresh=0.01)
        gain.set_ylim(-1, 8)
        draw_curves(success, rows, objects, 'success')
        mark_level(success, rows[f'{known}: success']['value'], 'her head known to 0.5 deg')
        mark_level(success, 1 / objects, 'chance')
        success.set(ylabel='success of the learner alone', ylim=(0, 1.02))
    for axes in panels[-1]:
        axes.set_xlabel('trials')
    figure.legend(
        *panels[0, 0].get_legend_handles_labels(), frameon=False, ncols=len(STYLES),
        loc='outside upper center',
    )  # fmt: skip
    OUTPUT.parent.mkdir(exist_ok=True)
    figure.savefig(OUTPUT)
    print(OUTPUT)


if __name__ == '__main__':
    main()
