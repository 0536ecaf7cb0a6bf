"""A node without a network: messages go into its callbacks, in order, as fast as it works."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

from rclpy.context import Context
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from ja_common.core.config import ConfigError
from ja_common.message_types import message_class
from ja_common.private_context import private_context
from ja_recording.core.reader import RecordedMessage


def decoded(message: RecordedMessage, kind: Any) -> Any:
    """Return a recorded message as one of this class.

    Raises ConfigError when it was recorded as another type, or when its bytes are none.
    """
    topic = message.topic
    if message_class(topic.type_name) is not kind:
        raise ConfigError(
            f'{topic.name} was recorded as {topic.type_name}; {kind.__name__} is needed: the '
            'recording is of another graph'
        )
    try:
        return deserialize_message(message.data, kind)
    except Exception as error:  # what rclpy raises depends on the middleware
        raise ConfigError(
            f'{topic.name}: the message at {message.stamp_ns} ns is damaged: {error}'
        ) from None


class DrivenNode:
    """A node that gets recorded messages, and whose own messages are kept.

    Nothing depends on scheduling: the same messages and parameters give the same answers, bit for
    bit. Timers do not run.
    """

    def __init__(
        self, make_node: Callable[..., Node], arguments: Sequence[str], context: Context
    ) -> None:
        """Make the node; `arguments`: ROS arguments without `--ros-args`."""
        cli = ['--ros-args', *arguments]
        self.node = make_node(context=context, cli_args=cli, use_global_arguments=False)
        self._callbacks = defaultdict(list)
        for subscription in self.node.subscriptions:
            self._callbacks[subscription.topic_name].append(
                (subscription.msg_type, subscription.callback)
            )
        self._published: list[tuple[str, Any]] = []
        for publisher in self.node.publishers:
            publisher.publish = partial(self._keep, publisher.topic_name)

    @property
    def subscribed_topics(self) -> set[str]:
        """Return the topics that the node subscribes."""
        return set(self._callbacks)

    def process_message(self, message: RecordedMessage) -> list[tuple[str, Any]]:
        """Call the node with a message; return what it publishes then: (topic, message).

        Raises ConfigError as `decoded`.
        """
        for kind, callback in self._callbacks.get(message.topic.name, ()):
            callback(decoded(message, kind))
        published, self._published = self._published, []
        return published

    def _keep(self, topic: str, message: Any) -> None:
        self._published.append((topic, message))


@contextmanager
def driven(make_node: Callable[..., Node], arguments: Sequence[str] = ()) -> Iterator[DrivenNode]:
    """Yield a node that neither finds nor is found by the graph that may run on this machine."""
    with private_context(discovery=False) as context:
        node = DrivenNode(make_node, arguments, context)
        try:
            yield node
        finally:
            node.node.destroy_node()
