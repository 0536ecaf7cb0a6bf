"""An executor for nodes of our own, beside a graph that runs in other processes."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import rclpy
from rclpy.context import Context

from ja_common.executor import CachedWaitSetExecutor


@contextmanager
def own_executor(arguments: Sequence[str] = ()) -> Iterator[CachedWaitSetExecutor]:
    """In a private context, `executor.context`; the nodes that are added to it end with it.

    `arguments`: ROS arguments for all of them. Signals stay with the caller.
    """
    context = Context()
    cli = ['--ros-args', *arguments] if arguments else []
    rclpy.init(args=cli, context=context, signal_handler_options=rclpy.SignalHandlerOptions.NO)
    executor = CachedWaitSetExecutor(context=context)
    try:
        yield executor
    finally:
        nodes = executor.get_nodes()
        executor.shutdown()
        for node in nodes:
            node.destroy_node()
        context.try_shutdown()
