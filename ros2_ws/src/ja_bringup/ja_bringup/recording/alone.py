"""`./ja record` and `./ja replay`: one node in the terminal, and how far it has come."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from statistics import median
from typing import Any

from rclpy.context import Context
from rclpy.node import Node
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from ja_bringup.graph import NodeSpec
from ja_bringup.one_process import run_in_one_process
from ja_bringup.progress import rate_text
from ja_bringup.recording.learner_score import score_learner, success_rate, write_csv
from ja_bringup.recording.reader import Recording
from ja_bringup.run import check_ros_arguments

_BLOCK_TRIALS = 50


def record(parameters: Mapping[str, Any], time_s: float, arguments: Sequence[str]) -> int:
    """Record until a signal, or for `time_s` (0: no end); the exit code."""
    spec = NodeSpec('ja_bringup', 'recorder', parameters, arguments=arguments)
    columns = (TextColumn('recording'), TextColumn('{task.description}'))
    with Progress(*columns, transient=True) as progress:
        task = progress.add_task('')
        nodes: list[Any] = []

        def done() -> bool:
            [node] = nodes
            progress.update(
                task,
                description=f'{node.elapsed_s:.0f} s, {node.topics} topics, '
                f'{node.writer.written} messages',
            )
            return node.writer.failure is not None or 0 < time_s < node.elapsed_s

        code = _run(spec, nodes, done)
    if code or not nodes:
        return code
    writer = nodes[0].writer
    print(f'{nodes[0].folder}: {writer.written} messages, {writer.dropped} dropped')
    if writer.failure:
        print(f'error: {writer.failure}')
    return int(writer.failure is not None)


def replay(parameters: Mapping[str, Any], arguments: Sequence[str]) -> int:
    """Play a recording to its end; the exit code."""
    _warn_of_unfinished(Recording(Path(parameters['recording'])))
    spec = NodeSpec('ja_bringup', 'player', parameters, arguments=arguments)
    columns = (
        TextColumn('{task.completed:.0f} of {task.total:.0f} s'), BarColumn(),
        TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns) as progress:
        task = progress.add_task('')
        nodes: list[Any] = []

        def done() -> bool:
            [node] = nodes
            length_s = 1e-9 * (node.recording.last_ns - node.recording.first_ns)
            position_s = min(max(node.position_s, 0.0), length_s)
            progress.update(task, total=length_s, completed=position_s)
            return node.done

        code = _run(spec, nodes, done)
    if nodes:
        print(f'{nodes[0].played} messages played')
    return code


def score(path: Path, csv_file: Path | None, as_json: bool, arguments: Sequence[str]) -> int:
    """Teach a learner the trials of a recording, and print its curve; the exit code."""
    check_ros_arguments(arguments)
    recording = Recording(path)
    _warn_of_unfinished(recording)
    columns = (BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task('', total=recording.last_ns - recording.first_ns)

        def advance(stamp_ns: int) -> None:
            progress.update(task, completed=stamp_ns - recording.first_ns)

        trials = score_learner(recording, arguments, advance)
    if csv_file is not None:
        write_csv(trials, csv_file)
    if as_json:
        print(json.dumps([asdict(trial) for trial in trials]))
        return 0
    if not trials:
        print('no trial of the recording ended in a fixation')
        return 0
    blocks = Table(title='learner over recorded trials', title_justify='left')
    for name in ('trials', 'off, median [deg]', 'learner succeeds', 'recorded success'):
        blocks.add_column(name)
    for first in range(0, len(trials), _BLOCK_TRIALS):
        block = trials[first : first + _BLOCK_TRIALS]
        off_deg = math.degrees(median(trial.off_rad for trial in block))
        rates = [rate_text(success_rate(block, of)) for of in ('success', 'recorded')]
        blocks.add_row(f'{first + 1} - {first + len(block)}', f'{off_deg:.1f}', *rates)
    Console().print(blocks)
    return 0


def _run(spec: NodeSpec, nodes: list[Any], done: Callable[[], bool]) -> int:
    check_ros_arguments(spec.ros_arguments()[1:])

    def make_node(context: Context) -> Node:
        arguments = spec.ros_arguments()
        make = spec.load()
        nodes.append(make(context=context, cli_args=arguments, use_global_arguments=False))
        return nodes[0]

    return run_in_one_process([], make_node, done)


def _warn_of_unfinished(recording: Recording) -> None:
    for path in recording.unfinished:
        text = f'{path} was not ended: it is read as far as it goes'
        Console(stderr=True).print(text, highlight=False, soft_wrap=True)
