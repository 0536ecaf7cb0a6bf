"""The success curve of a run, as CSV and as a picture."""

import csv
import io
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ja_common.core.files import write_file
from ja_common.core.learning_curve import LearningCurve, TrialRecord

CSV_NAME = 'success_curve.csv'
PNG_NAME = 'success_curve.png'


def write_csv(curve: LearningCurve, folder: Path) -> Path:
    """Write one row for each trial; return the path. Raises SaveError."""
    path = folder / CSV_NAME
    write_file(path, as_csv(curve))
    return path


def as_csv(curve: LearningCurve) -> str:
    """Return the table of the curve, one row for each trial."""
    text = io.StringIO(newline='')
    writer = csv.DictWriter(text, [field.name for field in fields(TrialRecord)])
    writer.writeheader()
    writer.writerows({**asdict(r), 'success': int(r.success)} for r in curve.records)
    return text.getvalue()


def draw_png(curve: LearningCurve, folder: Path, window: int) -> Path:
    """Plot the recent success rate and p(LM) over trials (as Figure 6 of the paper).

    Returns the path. Raises SaveError.
    """
    path = folder / PNG_NAME
    trials = [record.trial for record in curve.records]
    practice = [record.stage == 'practice' for record in curve.records]
    rates = np.where(practice, curve.recent_rates(window), np.nan)
    figure = Figure(figsize=(7, 4), layout='constrained')
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.plot(trials, rates, label=f'success, last {window} trials')
    axes.plot(trials, [r.p_lm for r in curve.records], '--', color='grey', label='p(LM), the gate')
    _draw_exams(axes, curve)
    axes.set(xlabel='trials', ylabel='rate', ylim=(0, 1.02), xlim=(0, max([1, *trials])))
    axes.grid(alpha=0.3)
    axes.legend(loc='lower right')
    picture = io.BytesIO()
    figure.savefig(picture, dpi=120, format='png')
    write_file(path, picture.getvalue())
    return path


def _draw_exams(axes: Axes, curve: LearningCurve) -> None:
    label = 'learner alone (95 % interval)'
    for stage in dict.fromkeys(r.stage for r in curve.records if r.stage.startswith('exam')):
        rate = curve.rate(stage=stage)
        trials = [record.trial for record in curve.trials_of_stage(stage)]
        errors = np.abs(np.subtract(rate.interval, rate.rate))[:, np.newaxis]
        axes.errorbar(np.mean(trials), rate.rate, errors, fmt='o', color='C1', label=label)
        label = '_again'
