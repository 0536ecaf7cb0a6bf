"""`./ja record` and `./ja replay`: run one node, with its progress on the terminal."""

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rclpy.context import Context
from rclpy.node import Node
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from ja_common.ros_arguments import check_ros_arguments
from ja_runner.node_spec import NodeSpec
from ja_runner.one_process import run_in_one_process


def record(parameters: Mapping[str, Any], time_s: float, arguments: Sequence[str]) -> int:
    """Record until a signal, or for `time_s` (0: no end); return the exit code."""
    spec = NodeSpec('ja_recording', 'recorder', parameters, arguments=arguments)
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
    """Play a recording to its end; return the exit code."""
    spec = NodeSpec('ja_recording', 'player', parameters, arguments=arguments)
    columns = (
        TextColumn('{task.completed:.0f} of {task.total:.0f} s'), BarColumn(),
        TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns) as progress:
        task = progress.add_task('', visible=False)  # until there is something to show
        nodes: list[Any] = []

        def done() -> bool:
            [node] = nodes
            position_s = min(max(node.position_s, 0.0), node.length_s)
            progress.update(task, total=node.length_s, completed=position_s, visible=True)
            return node.done

        code = _run(spec, nodes, done)
    if nodes:
        print(f'{nodes[0].played} messages played')
    return code


def _run(spec: NodeSpec, nodes: list[Any], done: Callable[[], bool]) -> int:
    check_ros_arguments(spec.ros_arguments()[1:])

    def make_node(context: Context) -> Node:
        arguments = spec.ros_arguments()
        make = spec.load()
        nodes.append(make(context=context, cli_args=arguments, use_global_arguments=False))
        return nodes[0]

    return run_in_one_process([], make_node, done, lambda text: print(text, file=sys.stderr))
