"""A node between the simulated head and the other nodes that disturbs the head's messages."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.publisher import Publisher

from ja_common.core.stamps import NS_PER_S
from ja_common.graph_node import GraphNode
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import CAMERA_INFO, CLOCK, IMAGE, JOINT_COMMANDS, JOINT_STATES, Topic
from ja_diagnostics.faults.disturbance import Disturbance

HEAD_TOPICS = (CLOCK, JOINT_STATES, CAMERA_INFO, IMAGE)
_PERIOD_S = 0.002


def _undisturbed(topic: Topic) -> str:
    return f'/undisturbed/{topic.name.lstrip("/")}'


AROUND: Mapping[str, str] = {topic.name: _undisturbed(topic) for topic in HEAD_TOPICS}
"""Remappings with which the head publishes to the relay instead of to the graph."""


class Relay(GraphNode):
    """Forwards the messages of the head, disturbed or not, with a clock that may be set."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('fault_relay', **node_kwargs)
        self._disturbances: dict[Topic, Disturbance] = {}
        self.clock_ahead_s = 0.0
        self._command_publisher: Publisher | None = None
        self._publishers_of: dict[Topic, Publisher] = {}
        for topic in HEAD_TOPICS:
            self._disturbances[topic] = Disturbance()
            self._publishers_of[topic] = self.create_topic_publisher(topic)
            # The publisher's QoS: a message lost here would be a fault that was not chosen.
            source = replace(topic, name=_undisturbed(topic), subscriber_qos=topic.publisher_qos)
            self.subscribe(source, self._queue_callback(topic))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_PERIOD_S, self._publish_due, clock=steady)

    def disturb(self, topics: Sequence[Topic], make: Callable[[], Disturbance]) -> None:
        """Replace the disturbance of topics; messages that the old one still holds are lost."""
        for topic in topics:
            self._disturbances[topic] = make()

    def publish_past_disturbances(self, topic: Topic, message: Any) -> None:
        """Publish a message that is not the head's."""
        self._publishers_of[topic].publish(message)

    def start_commanding(self) -> None:
        """Be another commander of the head, which sends nothing yet: the gate has to hold."""
        self._command_publisher = self.create_topic_publisher(JOINT_COMMANDS)

    def stop_commanding(self) -> None:
        """Leave the head to the gate again."""
        if self._command_publisher is not None:
            self.destroy_publisher(self._command_publisher)
            self._command_publisher = None

    def _queue_callback(self, topic: Topic) -> Callable[[Any], None]:
        def queue(message: Any) -> None:
            stamp_field = message.clock if topic is CLOCK else message.header.stamp
            # ROS has no negative time: set back far, the simulated clock stays just above zero.
            stamp = to_time(max(to_ns(stamp_field) + int(self.clock_ahead_s * NS_PER_S), 1))
            stamp_field.sec, stamp_field.nanosec = stamp.sec, stamp.nanosec
            self._disturbances[topic].queue_message(message, time.monotonic())
            self._publish_due()

        return queue

    def _publish_due(self) -> None:
        now_s = time.monotonic()
        for topic, disturbance in self._disturbances.items():
            for message in disturbance.pop_due(now_s):
                self._publishers_of[topic].publish(message)
