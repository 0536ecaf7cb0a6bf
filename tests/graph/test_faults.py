"""Faults of a running graph, in real processes."""

import os
import signal
import subprocess

import pytest
from rclpy.node import Node

from ja_common.executor import CachedWaitSetExecutor
from ja_common.topics import DIAGNOSTICS
from ja_runner.node_spec import NodeSpec
from ros_testing import spin_until

CONTROLLER = NodeSpec('ja_control', 'visual_feedback_controller')


@pytest.fixture
def controller(ros_context):
    """Run a node as a process."""
    process = subprocess.Popen(CONTROLLER.command())
    yield process
    process.kill()
    process.wait()


def test_name_of_a_node_that_was_halted_is_known_again(ros_context, controller):
    """Without a countermeasure DDS never sends the name again, and no tool knows the node."""
    watcher = Node('watcher', context=ros_context)
    complaints = []

    def note(array):
        complaints.extend(status.message for status in array.status)

    watcher.create_subscription(DIAGNOSTICS.type, DIAGNOSTICS.name, note, 10)
    executor = CachedWaitSetExecutor(context=ros_context)
    executor.add_node(watcher)

    def is_known():
        return CONTROLLER.executable in watcher.get_node_names()

    spin_until(executor, lambda: is_known() and complaints)
    os.kill(controller.pid, signal.SIGSTOP)
    spin_until(executor, lambda: not is_known())
    os.kill(controller.pid, signal.SIGCONT)
    spin_until(executor, is_known)
    spin_until(executor, lambda: any('this node stood still for' in text for text in complaints))
    executor.shutdown()
    watcher.destroy_node()
