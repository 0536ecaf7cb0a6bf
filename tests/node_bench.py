"""A bench for one node: a peer publishes to it over real topics and keeps its messages."""

import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ja_common.executor import CachedWaitSetExecutor
from ja_common.time_codec import to_time
from ja_common.topics import JOINT_STATES, Topic
from ros_testing import spin_until


class NodeBench:
    """The node under test (`node`) and its peer, spun by one executor in the test's own domain."""

    def __init__(
        self,
        context: Context,
        make_node: Callable[..., Node],
        publishes: Sequence[Topic] = (),
        subscribes: Sequence[Topic] = (),
        **parameters: Any,
    ) -> None:
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        self.node = make_node(context=context, parameter_overrides=overrides)
        self.peer = rclpy.create_node('peer', context=context)
        self.executor = CachedWaitSetExecutor(context=context)
        self.executor.add_node(self.node)
        self.executor.add_node(self.peer)
        self._received: dict[str, list] = defaultdict(list)
        self._publishers = {
            topic.name: self.peer.create_publisher(topic.type, topic.name, topic.publisher_qos)
            for topic in publishes
        }
        for topic in subscribes:
            keep = self._received[topic.name].append
            self.peer.create_subscription(topic.type, topic.name, keep, topic.subscriber_qos)
        ours = {f'/{topic.name}'.replace('//', '/') for topic in subscribes}
        answering = [p for p in self.node.publishers if p.topic_name in ours]
        talkers = [*self._publishers.values(), *answering]
        self.wait(lambda: all(p.get_subscription_count() for p in talkers))
        # Both sides must match: a best-effort message of an unmatched publisher is dropped.
        spoken = {p.topic_name for p in talkers}
        both = [*self.node.subscriptions, *self.peer.subscriptions]
        listeners = [s for s in both if s.topic_name in spoken]
        self.wait(lambda: all(s.get_publisher_count() for s in listeners))

    def close(self) -> None:
        """Destroy both nodes."""
        self.executor.shutdown()
        self.node.destroy_node()
        self.peer.destroy_node()

    def wait(self, condition: Callable[[], object]) -> None:
        """Spin until the condition holds."""
        spin_until(self.executor, condition)

    def publish(self, topic: Topic, message: Any) -> None:
        """Publish a message as the peer."""
        self._publishers[topic.name].publish(message)

    def publish_posture(
        self, stamp_ns: int, pan: float = 0.0, tilt: float = 0.0, **more: Any
    ) -> None:
        """Publish a joint state as the rig; the head is still unless `velocity` is given."""
        message = joint_state(stamp_ns, pan, tilt)
        message.velocity = [0.0, 0.0]
        for name, value in more.items():
            setattr(message, name, value)
        self.publish(JOINT_STATES, message)

    def messages(self, topic: Topic) -> list:
        """Return all messages that the peer has received on a topic."""
        return self._received[topic.name]

    def next(self, topic: Topic, count: int = 1) -> Any:
        """Wait for `count` more messages on a topic; return the last of them."""
        wanted = len(self.messages(topic)) + count
        self.wait(lambda: len(self.messages(topic)) >= wanted)
        return self.messages(topic)[wanted - 1]

    def received(self, topic: Topic) -> int:
        """Return how many messages the node under test has taken from a topic."""
        (name,) = [name for name, known in self.node.subscribed_topics.items() if known is topic]
        return int(self.node.health.report(time.monotonic()).values[f'{name} received'])

    def call(self, service_type: Any, name: str, **fields: Any) -> Any:
        """Call a service of the node; return its response."""
        client = self.peer.create_client(service_type, name)
        self.wait(client.service_is_ready)
        future = client.call_async(service_type.Request(**fields))
        self.wait(future.done)
        return future.result()

    def set_parameter(self, name: str, value: Any) -> Any:
        """Set a parameter as another process would; return the result with its reason."""
        client = AsyncParameterClient(self.peer, self.node.get_fully_qualified_name())
        self.wait(client.services_are_ready)
        future = client.set_parameters([Parameter(name, value=value)])
        self.wait(future.done)
        return future.result().results[0]

    def complaint(self) -> str:
        """Return the problems in the node's health report; 'OK' without any."""
        return self.node.health.report(time.monotonic()).message

    def wait_for_complaint(self, text: str) -> None:
        """Spin until the health report has this text; otherwise list all reports."""
        seen = set()

        def complained() -> bool:
            seen.add(self.complaint())
            return any(text in complaint for complaint in seen)

        try:
            self.wait(complained)
        except AssertionError:
            raise AssertionError(f'no complaint with {text!r}, only {seen}') from None


def header(stamp_ns: int, frame_id: str = 'eye') -> Header:
    """Return a header with a stamp in nanoseconds."""
    return Header(stamp=to_time(stamp_ns), frame_id=frame_id)


def joint_state(stamp_ns: int, *angles: float) -> JointState:
    """Return (pan, tilt) at a stamp [ns]; without angles an empty message."""
    names = ['pan', 'tilt'] if angles else []
    return JointState(header=header(stamp_ns), name=names, position=list(angles))
