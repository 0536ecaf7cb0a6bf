"""All nodes on one executor, in this process."""

import os
import signal
import time
from collections.abc import Callable

import pytest
from rclpy.context import Context
from rclpy.node import Node
from std_msgs.msg import String

from ja_runner.node_spec import NodeSpec
from ja_runner.one_process import run_in_one_process
from ros_testing import PATIENCE_S

pytestmark = pytest.mark.usefixtures('domain')


class Listener(Node):
    received: list[str] = []  # noqa: RUF012 (one listener a test, reset by `listener`)

    def __init__(self, context: Context) -> None:
        super().__init__('listener', context=context)
        self.create_subscription(String, '/ship/chatter', self._on_chatter, 10)

    def _on_chatter(self, message: String) -> None:
        self.received.append(message.data)


@pytest.fixture
def listener() -> type[Listener]:
    Listener.received = []
    return Listener


GRAPH = [
    NodeSpec('dummy_nodes', 'talker', {'text': text}, {'__ns': '/ship', '__node': text})
    for text in ('ann', 'ben')
]


def within(condition: Callable[[], bool], timeout_s: float = PATIENCE_S) -> Callable[[], bool]:
    """Return the condition, which raises AssertionError after `timeout_s` [s]."""
    end_s = time.monotonic() + timeout_s

    def checked() -> bool:
        assert time.monotonic() < end_s, 'condition not met in time'
        return condition()

    return checked


def test_nodes_keep_their_own_names_and_parameters(listener):
    both = {'ann from /ship/ann', 'ben from /ship/ben'}
    assert run_in_one_process(GRAPH, listener, within(lambda: both <= set(listener.received))) == 0


def test_a_signal_ends_it_cleanly(listener):
    before = signal.getsignal(signal.SIGTERM)

    def kill_when_running() -> bool:
        if listener.received:
            os.kill(os.getpid(), signal.SIGTERM)
        return False

    assert run_in_one_process(GRAPH, listener, within(kill_when_running)) == 0
    assert signal.getsignal(signal.SIGTERM) is before


def test_a_bad_parameter_gives_one_sentence(listener):
    reports: list[str] = []
    bad = NodeSpec('dummy_nodes', 'talker', {'text': 'bad'})
    assert run_in_one_process([*GRAPH, bad], listener, within(lambda: False), reports.append) == 2
    assert reports == ['error: talker: parameter text = bad cannot be used']
