"""A publisher of a topic that has got a new name: the old one works for one more release."""

from typing import Any

from ja_common.graph_node import GraphNode
from ja_common.topics import Topic


class RenamedPublisher:
    """Publishes under the new name, and under the old one, each while it has a subscriber."""

    def __init__(self, node: GraphNode, topic: Topic, old: Topic) -> None:
        """`old`: the topic under its old name; its first subscriber is one warning."""
        self._node = node
        self._publisher = node.create_topic_publisher(topic)
        self._old_publisher = node.create_topic_publisher(old)
        self._has_warned = False

    @property
    def is_subscribed(self) -> bool:
        """Return whether the topic has a subscriber, under either name."""
        return bool(
            self._publisher.get_subscription_count()
            or self._old_publisher.get_subscription_count()
        )

    def publish(self, message: Any) -> None:
        """Publish a message where there is a subscriber."""
        if self._publisher.get_subscription_count():
            self._publisher.publish(message)
        if self._old_publisher.get_subscription_count():
            self._warn()
            self._old_publisher.publish(message)

    def _warn(self) -> None:
        if not self._has_warned:
            self._has_warned = True
            self._node.get_logger().warning(
                f'a node subscribes to {self._old_publisher.topic_name}, which the next release '
                f'will not have: subscribe to {self._publisher.topic_name}'
            )
