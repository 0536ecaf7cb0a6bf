"""A meeting with a person: the graph runs until all requests were made, then its figures."""

import time
from collections.abc import Sequence
from pathlib import Path

from ja_caregiver.core.meeting import MEETING_FILE, Meeting, load_meeting
from ja_caregiver.core.meeting_folder import write_report
from ja_common.core.config import ConfigError
from ja_runner.node_spec import NodeSpec
from ja_runner.progress import ProgressNode
from ja_runner.run import check_memory, run_graph
from ja_runner.supervisor import DEFAULT, Supervision

_CHECKED_EVERY_S = 0.5
# So long the page shows the end, with the report, before it closes with the graph.
_SHOWN_S = 30.0


class MeetingWatch:
    """Returns whether the meeting of a folder is over, by the file that the scorer writes.

    It does not subscribe to the request: only the page does.
    """

    def __init__(self, folder: Path, shown_s: float) -> None:
        """`shown_s`: how long the graph runs on after the end [s]."""
        self._path = folder / MEETING_FILE
        self._shown_s = shown_s
        self._checked_s = -_CHECKED_EVERY_S
        self._ended_s: float | None = None

    def is_over(self, now_s: float) -> bool:
        """Return whether the meeting has ended for long enough; `now_s`: a steady time [s]."""
        if self._ended_s is None and now_s - self._checked_s >= _CHECKED_EVERY_S:
            self._checked_s = now_s
            meeting = find_meeting(self._path)
            if meeting is not None and meeting.ended:
                self._ended_s = now_s
        return self._ended_s is not None and now_s - self._ended_s >= self._shown_s


def find_meeting(path: Path) -> Meeting | None:
    """Return the meeting of a file; None where there is none that can be read."""
    try:
        return load_meeting(path)
    except (ValueError, OSError):
        return None


def source_kind(source: str | None) -> str:
    """Return what a meeting notes of its source: webcam (or address), topics, or film."""
    if source is None:
        return 'topics'
    return 'film' if Path(source).expanduser().is_file() else 'webcam'


def run_meeting(
    graph: Sequence[NodeSpec],
    folder: Path,
    *,
    one_process: bool = False,
    view: bool = True,
    markers: bool = False,
    supervision: Supervision = DEFAULT,
    arguments: Sequence[str] = (),
    resume: Path | None = None,
) -> int:
    """Run a meeting until its end or a signal, and print its figures; return the exit code.

    The code is 0 if a request was answered. `folder`: of the run, in which the scorer saves.
    `resume`: the folder of a run whose learner and gate go on from where they ended. Raises
    ConfigError when that folder holds no checkpoint.
    """
    if resume is not None:
        check_memory(resume)
    watch = MeetingWatch(folder, _SHOWN_S if view else 0.0)

    def over(_: ProgressNode) -> bool:
        return watch.is_over(time.monotonic())

    code, _ = run_graph(
        graph,
        folder,
        'Joint attention, with a person',
        over,
        one_process=one_process,
        view=view,
        markers=markers,
        supervision=supervision,
        arguments=arguments,
        memory=resume,
    )
    return print_end(folder, code)


def print_end(folder: Path, code: int) -> int:
    """Print the figures of the meeting in a folder and where its report is; return the exit code.

    `code`: of the graph. It becomes 1 where no request was answered, or the report is missing.
    """
    meeting = find_meeting(folder / MEETING_FILE)
    if meeting is None or not meeting.trials:
        print('no request was answered')
        return code or 1
    lines = summary(meeting)
    try:
        lines.append(f'report: {write_report(meeting, folder)}')
    except (OSError, ConfigError) as error:
        lines.append(f'error: {error}')
        code = code or 1
    for line in lines:
        print(line)
    return code


def summary(meeting: Meeting) -> list[str]:
    """Return the figures of a meeting in a few lines."""
    trials = meeting.trials
    followed = sum(trial.followed_learner for trial in trials)
    lines = [
        f'{len(trials)} requests; the head followed the learner {followed} times',
        f'success, learner alone: {meeting.learner_rate()}',
        f'success of the head:    {meeting.success_rate()}',
        f'chance, one thing of those there: {meeting.chance():.2f}',
    ]
    missed = [trial for trial in trials if not trial.success]
    if missed:
        numbers = ', '.join(f'{trial.trial} (thing {trial.asked})' for trial in missed)
        lines.append(f'missed: {numbers}')
    return [*lines, f'track of the learner: {meeting.track}'] if meeting.track else lines
