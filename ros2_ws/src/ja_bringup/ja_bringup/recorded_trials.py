"""The trials of recordings, for `./ja replay --score` and `./ja export`."""

import json
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from ja_common.core.files import check_file_writable, check_writable
from ja_common.ros_arguments import check_ros_arguments
from ja_recording.core.bag_metadata import read_metadata
from ja_recording.core.dataset import TrialSample, write_dataset
from ja_recording.core.reader import Recording, print_remarks
from ja_recording.learner_score import ScoredTrial, score_learner, success_rate, write_csv
from ja_recording.trials import RecordedTrial, recorded_trials

_BLOCK_TRIALS = 50


def score(
    path: Path,
    without: Sequence[str],
    csv_file: Path | None,
    as_json: bool,
    arguments: Sequence[str],
) -> int:
    """Train a learner on the trials of a recording, print its curve; return the exit code."""
    check_ros_arguments(arguments)
    if csv_file is not None:
        check_file_writable(csv_file)
    recording = Recording(path, without)
    print_remarks(recording)
    with _bar(recording, path.name) as advance:
        trials = score_learner(recording, arguments, advance)
    if as_json:
        print(json.dumps([asdict(trial) for trial in trials]))
    elif not trials:
        print('no trial of the recording ended in a fixation')
    else:
        _print_curve(trials)
    if csv_file is not None:  # last: what is printed is not lost if this fails
        write_csv(trials, csv_file)
    return 0


def _print_curve(trials: Sequence[ScoredTrial]) -> None:
    blocks = Table(
        title=f'learner over recorded trials, track: {trials[-1].track}', title_justify='left'
    )
    for name in ('trials', 'off, median [deg]', 'learner succeeds', 'recorded success'):
        blocks.add_column(name)
    for first in range(0, len(trials), _BLOCK_TRIALS):
        block = trials[first : first + _BLOCK_TRIALS]
        off_deg = math.degrees(median(trial.off_rad for trial in block))
        rates = [str(success_rate(block, of)) for of in ('success', 'recorded')]
        blocks.add_row(f'{first + 1} - {first + len(block)}', f'{off_deg:.1f}', *rates)
    Console().print(blocks)


def export(paths: Sequence[Path], folder: Path, licence: str, arguments: Sequence[str]) -> int:
    """Turn recordings into one data set of trials; return the exit code."""
    check_ros_arguments(arguments)
    check_writable(folder)
    recordings = {path: Recording(path) for path in paths}

    def samples() -> Iterator[TrialSample]:
        for path, recording in recordings.items():
            print_remarks(recording)
            with _bar(recording, path.name) as advance:
                for trial in recorded_trials(recording, arguments, advance):
                    yield sample_of(trial, path.resolve().name)

    origins = {
        path.resolve().name: read_metadata(path if path.is_dir() else path.parent).custom_data
        for path in paths
    }
    card = write_dataset(folder, samples(), arguments, licence, origins)
    print(f'the data set, and what is in it: {card}')
    return 0


def sample_of(trial: RecordedTrial, recording: str) -> TrialSample:
    """Return a recorded trial as a row of a data set."""
    return TrialSample(
        trial.trial,
        recording,
        trial.look_ns,
        trial.fixation_ns,
        trial.source,
        trial.attended_direction,
        trial.is_joint_attention(trial.trial.led_to),
    )


@contextmanager
def _bar(recording: Recording, name: str) -> Iterator[Callable[[int], None]]:
    """Show how far a recording is read; yield a function that takes each message's stamp [ns]."""
    columns = (TextColumn('{task.description}'), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(name, total=recording.last_ns - recording.first_ns)
        yield lambda stamp_ns: progress.update(task, completed=stamp_ns - recording.first_ns)
