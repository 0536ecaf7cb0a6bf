"""Subscriptions that wake no executor: their messages wait in the middleware until polled."""

from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ja_common.rclpy_private import UnspunSubscription
from ja_common.topics import Topic


class PolledSubscription:
    """Keeps the newest messages of a topic in the middleware; the publisher never waits for it.

    On a graph with a thousand messages a second, waking the node for each would cost more than
    all that it does with the few that it looks at.
    """

    def __init__(self, node: Node, topic: Topic, depth: int) -> None:
        """Subscribe: best effort, whatever the topic's own QoS; keep up to `depth` messages."""
        qos = QoSProfile(
            depth=depth,
            reliability=ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.VOLATILE,
        )
        self._subscription = UnspunSubscription(node, topic.type, topic.name, qos)

    @property
    def publishers(self) -> int:
        """Return how many publishers are connected; messages of any other are lost."""
        return self._subscription.publisher_count()

    def take_messages(self) -> list[tuple[Any, int]]:
        """Return what has come since the last call, oldest first: (message, sending time [ns])."""
        return self._subscription.take_messages()

    def close(self) -> None:
        """Unsubscribe."""
        self._subscription.close()
