"""All nodes in one process, on one executor: faster messages, one log, one exit."""

import signal
from collections.abc import Callable, Sequence

from rclpy.context import Context
from rclpy.node import Node

from ja_common.core.config import ConfigError
from ja_common.executor import CachedWaitSetExecutor
from ja_common.private_context import private_context
from ja_runner.node_spec import NodeSpec


def run_in_one_process(
    graph: Sequence[NodeSpec],
    make_observer: Callable[[Context], Node],
    done: Callable[[], bool],
    report: Callable[[str], None] = print,
) -> int:
    """Run the graph and an observing node until `done()`, SIGINT or SIGTERM.

    Returns the exit code: 0, or 1 when a node cannot be made (`report` gets one sentence).
    """
    stop = _StopSignal()
    try:
        with private_context() as context:
            _run_nodes(graph, make_observer, lambda: stop.received or done(), context)
    except (ConfigError, OSError) as error:
        report(f'error: {error}')
        return 1
    finally:
        stop.restore()
    return 0


def _run_nodes(
    graph: Sequence[NodeSpec],
    make_observer: Callable[[Context], Node],
    done: Callable[[], bool],
    context: Context,
) -> None:
    executor = CachedWaitSetExecutor(context=context)
    nodes: list[Node] = []
    try:
        for spec in graph:
            make = spec.load()
            arguments = spec.ros_arguments()
            node = make(context=context, cli_args=arguments, use_global_arguments=False)
            nodes.append(node)
        nodes.append(make_observer(context))
        for node in nodes:
            executor.add_node(node)
        while not done():
            executor.spin_once(timeout_sec=0.1)
    finally:
        executor.shutdown()
        for node in reversed(nodes):
            node.destroy_node()


class _StopSignal:
    """SIGINT and SIGTERM as a flag, so that no callback is interrupted."""

    def __init__(self) -> None:
        self.received = False
        self._before = {
            number: signal.signal(number, self._on_signal)
            for number in (signal.SIGINT, signal.SIGTERM)
        }

    def _on_signal(self, *_: object) -> None:
        self.received = True

    def restore(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
