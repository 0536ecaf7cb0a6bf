"""The success curve of a run, as CSV and as a picture."""

import csv
import io
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ja_common.core.files import write_file
from ja_common.core.learning_curve import LearningCurve, TrialRecord
from ja_common.core.weight_files import weight_files_text

CSV_NAME = 'success_curve.csv'
PNG_NAME = 'success_curve.png'


@dataclass(frozen=True)
class CurveOrigin:
    """What the learner of a curve started from: its track, and the weight files of the eyes.

    `weight_files`: name -> SHA-256. Both empty where the graph did not publish them.
    """

    track: str = ''
    weight_files: Mapping[str, str] = field(default_factory=dict)


def write_csv(curve: LearningCurve, folder: Path, origin: CurveOrigin) -> Path:
    """Write one row for each trial; return the path. Raises SaveError."""
    path = folder / CSV_NAME
    write_file(path, as_csv(curve, origin))
    return path


def as_csv(curve: LearningCurve, origin: CurveOrigin) -> str:
    """Return the table of the curve, one row for each trial.

    Every row has the track and the weight files: rows of several runs can be put together.
    """
    started_from = {
        'track': origin.track,
        'weight_files': weight_files_text(origin.weight_files),
    }
    text = io.StringIO(newline='')
    names = [each.name for each in fields(TrialRecord)]
    writer = csv.DictWriter(text, [*names, *started_from])
    writer.writeheader()
    writer.writerows(
        {**asdict(r), 'success': int(r.success), **started_from} for r in curve.records
    )
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
