"""A learner's curve over recorded trials: on each it proposes first, then it learns from it."""

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from ja_common.core.files import write_file
from ja_common.core.geometry import angle_between
from ja_common.core.statistics import Rate
from ja_recording.core.reader import Recording
from ja_recording.trials import recorded_trials


@dataclass(frozen=True)
class ScoredTrial:
    """One recorded trial that ended in a fixation, on the image of this stamp.

    `off_rad`: angle from what the learner proposed in the look at the caregiver to what was
    fixated. `success`: whether the attended object was the nearest to the proposal. `recorded`:
    whether the attended object was fixated. Both None without the truth of a simulation.
    `track`: of the learner, as `ja_learning.core.track`.
    """

    trial: int
    stamp_ns: int
    off_rad: float
    success: bool | None
    recorded: bool | None
    track: str


def score_learner(
    recording: Recording,
    arguments: Sequence[str] = (),
    progress: Callable[[int], None] = lambda stamp_ns: None,
) -> list[ScoredTrial]:
    """Drive a learning module, with these ROS arguments, through a recording; score its trials.

    Raises ConfigError when the recording lacks a topic that a learner needs.
    """
    return [
        ScoredTrial(
            number,
            trial.fixation_ns,
            float(angle_between(trial.proposed, trial.trial.led_to)),
            trial.is_joint_attention(trial.proposed),
            trial.is_joint_attention(trial.trial.led_to),
            trial.track,
        )
        for number, trial in enumerate(recorded_trials(recording, arguments, progress), 1)
    ]


def write_csv(trials: Sequence[ScoredTrial], path: Path) -> None:
    """Write one row a trial; without truth, the fields that need it are empty.

    Raises SaveError.
    """
    text = io.StringIO(newline='')
    writer = csv.DictWriter(text, [field.name for field in fields(ScoredTrial)])
    writer.writeheader()
    for trial in trials:
        row = asdict(trial)
        writer.writerow({k: int(v) if isinstance(v, bool) else v for k, v in row.items()})
    write_file(path, text.getvalue())


def success_rate(trials: Sequence[ScoredTrial], of: str = 'success') -> Rate:
    """Return the share of successes among the trials of which the truth is known."""
    known = [getattr(trial, of) for trial in trials if trial.success is not None]
    return Rate(sum(known), len(known))
