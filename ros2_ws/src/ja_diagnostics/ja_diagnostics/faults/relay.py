"""Stands between the simulated head and the mind, and disturbs what the head says."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.publisher import Publisher

from ja_common.core.stamps import NS_PER_S
from ja_common.graph_node import GraphNode
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import CAMERA_INFO, CLOCK, IMAGE, JOINT_STATES, Topic
from ja_diagnostics.faults.disturbance import Disturbance

HEAD_SAYS = (CLOCK, JOINT_STATES, CAMERA_INFO, IMAGE)
_PERIOD_S = 0.002


def _undisturbed(topic: Topic) -> str:
    return f'/undisturbed/{topic.name.lstrip("/")}'


AROUND: Mapping[str, str] = {topic.name: _undisturbed(topic) for topic in HEAD_SAYS}
"""Remappings with which the head speaks to the relay instead of to the graph."""


class Relay(GraphNode):
    """Passes on what the head says, disturbed or not, by a clock that may be set."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('fault_relay', **node_kwargs)
        self._disturbances: dict[Topic, Disturbance] = {}
        self.clock_ahead_s = 0.0
        self._publishers_of: dict[Topic, Publisher] = {}
        for topic in HEAD_SAYS:
            self._disturbances[topic] = Disturbance()
            self._publishers_of[topic] = self.create_topic_publisher(topic)
            # Everything is heard: what is lost here would be a fault that nobody asked for.
            heard = replace(topic, name=_undisturbed(topic), subscriber_qos=topic.publisher_qos)
            self.subscribe(heard, self._putter(topic))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_PERIOD_S, self._pass_on, clock=steady)

    def disturb(self, topics: Sequence[Topic], make: Callable[[], Disturbance]) -> None:
        """From now on so; what an earlier disturbance still held back is lost."""
        for topic in topics:
            self._disturbances[topic] = make()

    def _putter(self, topic: Topic) -> Callable[[Any], None]:
        def put(message: Any) -> None:
            told = message.clock if topic is CLOCK else message.header.stamp
            # Set back far, the simulated clock would fall below nought, where ROS has no time.
            stamp = to_time(max(to_ns(told) + int(self.clock_ahead_s * NS_PER_S), 1))
            told.sec, told.nanosec = stamp.sec, stamp.nanosec
            self._disturbances[topic].put(message, time.monotonic())
            self._pass_on()

        return put

    def _pass_on(self) -> None:
        now_s = time.monotonic()
        for topic, disturbance in self._disturbances.items():
            for message in disturbance.due(now_s):
                self._publishers_of[topic].publish(message)
