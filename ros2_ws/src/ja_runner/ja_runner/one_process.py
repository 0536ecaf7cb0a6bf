"""All nodes in one process, on one executor: quicker messages, one log, one fate."""

import signal
from collections.abc import Callable, Sequence

import rclpy
from rclpy.context import Context
from rclpy.node import Node

from ja_common.core.config import ConfigError
from ja_common.executor import CachedWaitSetExecutor
from ja_runner.graph import NodeSpec


def run_in_one_process(
    graph: Sequence[NodeSpec],
    make_observer: Callable[[Context], Node],
    done: Callable[[], bool],
    report: Callable[[str], None] = print,
) -> int:
    """Compose the graph and an observing node; spin until `done()`, SIGINT or SIGTERM.

    Returns the exit code: 0, or 1 when a node cannot be made (one sentence is reported).
    """
    context = Context()
    rclpy.init(args=[], context=context, signal_handler_options=rclpy.SignalHandlerOptions.NO)
    executor = CachedWaitSetExecutor(context=context)
    stop = _Stop()
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
        while not (stop.asked or done()):
            executor.spin_once(timeout_sec=0.1)
    except (ConfigError, OSError) as error:
        report(f'error: {error}')
        return 1
    finally:
        executor.shutdown()
        for node in reversed(nodes):
            node.destroy_node()
        context.try_shutdown()
        stop.restore()
    return 0


class _Stop:
    """SIGINT and SIGTERM as a flag: nothing is torn down in the middle of a callback."""

    def __init__(self) -> None:
        self.asked = False
        self._before = {
            number: signal.signal(number, self._ask) for number in (signal.SIGINT, signal.SIGTERM)
        }

    def _ask(self, *_: object) -> None:
        self.asked = True

    def restore(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
