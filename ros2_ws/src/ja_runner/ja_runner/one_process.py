"""All nodes in one process, on one executor: faster messages, one log, one exit."""

from collections.abc import Callable, Sequence

from rclpy.context import Context
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from ja_common.core.config import ConfigError
from ja_common.executor import CachedWaitSetExecutor
from ja_common.node_main import check_parameters
from ja_common.private_context import private_context
from ja_common.stop_signals import StopSignals
from ja_runner.node_spec import NodeSpec


def run_in_one_process(
    graph: Sequence[NodeSpec],
    make_observer: Callable[[Context], Node],
    done: Callable[[], bool],
    report: Callable[[str], None] = print,
) -> int:
    """Run the graph and an observing node until `done()`, SIGINT, SIGTERM or SIGHUP.

    Returns the exit code: 0, or 2 when a node cannot be made (`report` gets one sentence).
    """
    try:
        with StopSignals() as stop, private_context() as context:
            _run_nodes(graph, make_observer, lambda: stop.requested or done(), context)
    except ExternalShutdownException:
        pass  # a node has ended the graph: a film without a loop is over
    except (ConfigError, OSError) as error:
        report(f'error: {error}')
        return 2
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
            check_parameters(node, arguments[1:])
        nodes.append(make_observer(context))
        for node in nodes:
            executor.add_node(node)
        while not done():
            executor.spin_once(timeout_sec=0.1)
    finally:
        executor.shutdown()
        for node in reversed(nodes):
            node.destroy_node()
