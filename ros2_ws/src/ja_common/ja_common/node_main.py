"""The `main` of a node's process: make the node, serve it, end it in order."""

import signal
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from ja_common.core.config import ConfigError
from ja_common.core.home_folder import replace_missing_home
from ja_common.executor import CachedWaitSetExecutor
from ja_common.graph_node import GraphNode
from ja_common.heartbeat import PERIOD_S, heartbeat
from ja_common.node_usage import node_usage
from ja_common.ros_arguments import domain_id, rcl_sentence, split_ros_arguments
from ja_common.ros_defaults import apply_ros_defaults
from ja_common.stop_signals import StopSignals, end_process

# A node that is asked to stop before it is made has nothing to save.
_START_PATIENCE_S = 1.0


def spin_node(make_node: Callable[[], Node], args: Sequence[str] | None = None) -> None:
    """Run a node as the `main` of its process, until SIGINT, SIGTERM or SIGHUP.

    A second signal ends the process at once. Exits with code 2 and one sentence for a
    configuration that cannot be used. With `--help` it prints the usage, and makes no node.
    """
    replace_missing_home()
    apply_ros_defaults()
    ours, _ = split_ros_arguments(_arguments(args))
    if {'--help', '-h'} & set(ours):
        with suppress(BrokenPipeError):  # `gate --help | head`
            print(node_usage(make_node.__module__), flush=True)
        return
    try:
        if ours:
            raise ConfigError(f'unknown: {" ".join(ours)}; parameters: --ros-args -p NAME:=VALUE')
        domain_id()
        with StopSignals() as stop:
            _run(make_node, args, stop)
    except (ConfigError, OSError) as error:
        print(f'error: {error}', file=sys.stderr)
        sys.exit(2)


def _run(make_node: Callable[[], Node], args: Sequence[str] | None, stop: StopSignals) -> None:
    made = threading.Event()
    stop.call_at_request(lambda: _end_unless(made))
    _init(args)
    node = None
    try:
        node = make_node()
        check_parameters(node, split_ros_arguments(_arguments(args))[1])
        made.set()
        _start_heartbeat(node)
        executor = CachedWaitSetExecutor()
        executor.add_node(node)
        stop.call_at_request(executor.wake)
        while not stop.requested:
            executor.spin_once()
    except ExternalShutdownException:
        pass  # the node has ended its context: there is nothing more to do
    finally:
        made.set()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()


def check_parameters(node: Node, arguments: Sequence[str]) -> None:
    """Let a node of ours report what it was given and does not have (`GraphNode`)."""
    if isinstance(node, GraphNode):
        node.check_parameters(arguments)


def _arguments(args: Sequence[str] | None) -> Sequence[str]:
    return sys.argv[1:] if args is None else args


def _start_heartbeat(node: Node) -> None:
    """Send the first beat now, and one each period while the executor serves this node."""
    if beat := heartbeat():
        beat()
        node.create_timer(PERIOD_S, beat, clock=Clock(clock_type=ClockType.STEADY_TIME))


def _end_unless(made: threading.Event) -> None:
    def watch() -> None:
        if not made.wait(_START_PATIENCE_S):
            end_process(signal.SIGTERM)

    threading.Thread(target=watch, name='end of the start', daemon=True).start()


def _init(args: Sequence[str] | None) -> None:
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        # An unknown argument, or a parameter file that is missing or no YAML.
        raise ConfigError(f'ROS arguments cannot be used: {rcl_sentence(error)}') from None
