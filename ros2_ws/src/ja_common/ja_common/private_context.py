"""Private contexts: nodes beside a graph of other processes, which leave signals to the caller."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import rclpy
from rclpy.context import Context

from ja_common.executor import CachedWaitSetExecutor

_RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'


@contextmanager
def private_context(
    arguments: Sequence[str] = (), *, discovery: bool = True, domain_id: int | None = None
) -> Iterator[Context]:
    """Initialise a context of its own, which ends with the block; signals stay with the caller.

    `arguments`: ROS arguments for all its nodes, without `--ros-args`. Without `discovery` its
    nodes neither find other nodes nor are found. `domain_id`: None for that of the environment.
    """
    context = Context()
    cli = ['--ros-args', *arguments] if arguments else []
    before = os.environ.get(_RANGE)
    if not discovery:
        os.environ[_RANGE] = 'OFF'  # read by `rclpy.init` and by nothing later
    try:
        rclpy.init(
            args=cli,
            context=context,
            domain_id=domain_id,
            signal_handler_options=rclpy.SignalHandlerOptions.NO,
        )
    finally:
        if not discovery:
            if before is None:
                del os.environ[_RANGE]
            else:
                os.environ[_RANGE] = before
    try:
        yield context
    finally:
        context.try_shutdown()


@contextmanager
def private_executor(arguments: Sequence[str] = ()) -> Iterator[CachedWaitSetExecutor]:
    """Make an executor in a private context, `executor.context`; its nodes end with the block.

    `arguments`: ROS arguments for all its nodes, without `--ros-args`.
    """
    with private_context(arguments) as context:
        executor = CachedWaitSetExecutor(context=context)
        try:
            yield executor
        finally:
            nodes = executor.get_nodes()
            executor.shutdown()
            for node in nodes:
                node.destroy_node()
