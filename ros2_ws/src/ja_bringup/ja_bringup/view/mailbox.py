"""Subscriptions that wake nobody: their messages wait until somebody asks for them."""

from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ja_common.topics import Topic


class _Asleep(CallbackGroup):
    """Nothing in it is ever executed, so that no executor wakes for it."""

    def can_execute(self, _entity: Any) -> bool:
        return False

    def beginning_execution(self, _entity: Any) -> bool:
        return False

    def ending_execution(self, _entity: Any) -> None:
        return None


class Mailbox:
    """Keeps the newest messages of a topic in the middleware; the publisher never waits for us."""

    def __init__(self, node: Node, topic: Topic, depth: int) -> None:
        """Best effort, whatever the topic's own quality of service; up to `depth` messages."""
        self._node = node
        self._subscription = node.create_subscription(
            topic.type,
            topic.name,
            lambda _: None,
            _quiet(depth),
            callback_group=_Asleep(),
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
        )

    def take(self) -> list[tuple[Any, int]]:
        """What has come since the last call, oldest first, each with the time [ns] of sending."""
        taken = []
        handle = self._subscription.handle
        with handle:
            while (found := handle.take_message(self._subscription.msg_type, False)) is not None:
                message, information = found
                taken.append((message, information['source_timestamp']))
        return taken

    def close(self) -> None:
        """Unsubscribe."""
        self._node.destroy_subscription(self._subscription)


def _quiet(depth: int) -> QoSProfile:
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.VOLATILE,
    )
