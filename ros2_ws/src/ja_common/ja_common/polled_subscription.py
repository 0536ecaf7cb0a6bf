"""Subscriptions that wake nobody: their messages wait until somebody asks for them."""

from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation as implementation
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.type_support import check_for_type_support

from ja_common.topics import Topic


class Mailbox:
    """Keeps the newest messages of a topic in the middleware; the publisher never waits for us.

    The node does not know of the subscription, and so no executor waits for it: on a graph that
    says a thousand messages a second, waking for each would cost more than all that we do with
    the few that we look at.
    """

    def __init__(self, node: Node, topic: Topic, depth: int) -> None:
        """Best effort, whatever the topic's own quality of service; up to `depth` messages."""
        check_for_type_support(topic.type)
        self._type = topic.type
        quiet = QoSProfile(
            depth=depth,
            reliability=ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.VOLATILE,
        )
        with node.handle:
            self._handle = implementation.Subscription(
                node.handle, topic.type, topic.name, quiet.get_c_qos_profile()
            )

    @property
    def publishers(self) -> int:
        """How many publishers it hears; a best-effort message from any other is lost."""
        with self._handle:
            return self._handle.get_publisher_count()

    def take(self) -> list[tuple[Any, int]]:
        """What has come since the last call, oldest first, each with the time [ns] of sending."""
        taken = []
        with self._handle:
            while (found := self._handle.take_message(self._type, False)) is not None:
                message, information = found
                taken.append((message, information['source_timestamp']))
        return taken

    def close(self) -> None:
        """Unsubscribe."""
        self._handle.destroy_when_not_in_use()
