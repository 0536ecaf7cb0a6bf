"""A node without a network: messages are put into its callbacks, in order, as fast as it goes."""

import os
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from ja_common.message_types import message_class
from ja_recording.core.reader import RecordedMessage

_RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'


class DrivenNode:
    """Feeds a node with recorded messages and keeps what it says.

    Nothing depends on scheduling: the same messages and parameters give the same answers, bit for
    bit. Timers do not run.
    """

    def __init__(
        self, make_node: Callable[..., Node], arguments: Sequence[str], context: Context
    ) -> None:
        """`arguments`: ROS arguments without `--ros-args`."""
        cli = ['--ros-args', *arguments]
        self.node = make_node(context=context, cli_args=cli, use_global_arguments=False)
        self._callbacks = defaultdict(list)
        for subscription in self.node.subscriptions:
            self._callbacks[subscription.topic_name].append(subscription.callback)
        self._said: list[tuple[str, Any]] = []
        for publisher in self.node.publishers:
            publisher.publish = partial(self._keep, publisher.topic_name)

    @property
    def hears(self) -> set[str]:
        """The topics that it listens to."""
        return set(self._callbacks)

    def hear(self, message: RecordedMessage) -> list[tuple[str, Any]]:
        """Give it a message; what it says then: (topic, message)."""
        if message.topic.name in self._callbacks:
            kind = message_class(message.topic.type_name)
            decoded = deserialize_message(message.data, kind)
            for callback in self._callbacks[message.topic.name]:
                callback(decoded)
        said, self._said = self._said, []
        return said

    def _keep(self, topic: str, message: Any) -> None:
        self._said.append((topic, message))


@contextmanager
def driven(make_node: Callable[..., Node], arguments: Sequence[str] = ()) -> Iterator[DrivenNode]:
    """A node that neither finds nor is found by the graph that may run on this machine."""
    before = os.environ.get(_RANGE)
    os.environ[_RANGE] = 'OFF'
    context = Context()
    try:
        rclpy.init(args=[], context=context, signal_handler_options=rclpy.SignalHandlerOptions.NO)
    finally:
        if before is None:
            del os.environ[_RANGE]
        else:
            os.environ[_RANGE] = before
    node = None
    try:
        node = DrivenNode(make_node, arguments, context)
        yield node
    finally:
        if node is not None:
            node.node.destroy_node()
        context.try_shutdown()
