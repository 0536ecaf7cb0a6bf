"""A bench for one node: a peer speaks to it over real topics and keeps all that it says."""

import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

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
        self.executor = SingleThreadedExecutor(context=context)
        self.executor.add_node(self.node)
        self.executor.add_node(self.peer)
        self._heard: dict[str, list] = defaultdict(list)
        self._publishers = {
            topic.name: self.peer.create_publisher(topic.type, topic.name, topic.publisher_qos)
            for topic in publishes
        }
        for topic in subscribes:
            keep = self._heard[topic.name].append
            self.peer.create_subscription(topic.type, topic.name, keep, topic.subscriber_qos)
        ours = {f'/{topic.name}'.replace('//', '/') for topic in subscribes}
        answering = [p for p in self.node.publishers if p.topic_name in ours]
        speakers = [*self._publishers.values(), *answering]
        self.wait(lambda: all(p.get_subscription_count() for p in speakers))
        # Both sides must know: a best-effort listener drops what comes from a stranger.
        spoken = {p.topic_name for p in speakers}
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
        """The peer publishes."""
        self._publishers[topic.name].publish(message)

    def publish_posture(
        self, stamp_ns: int, pan: float = 0.0, tilt: float = 0.0, **more: Any
    ) -> None:
        """The rig publishes a joint state; the head stands still unless `velocity` is given."""
        message = joint_state(stamp_ns, pan, tilt)
        message.velocity = [0.0, 0.0]
        for name, value in more.items():
            setattr(message, name, value)
        self.publish(JOINT_STATES, message)

    def messages(self, topic: Topic) -> list:
        """All that the peer has heard on a topic."""
        return self._heard[topic.name]

    def next(self, topic: Topic, count: int = 1) -> Any:
        """Wait for `count` more messages on a topic; the last of them."""
        wanted = len(self.messages(topic)) + count
        self.wait(lambda: len(self.messages(topic)) >= wanted)
        return self.messages(topic)[wanted - 1]

    def received(self, topic: Topic) -> int:
        """How many messages the node under test has taken from a topic."""
        (name,) = [name for name, heard in self.node.subscribed_topics.items() if heard is topic]
        return int(self.node.health.report(time.monotonic()).values[f'{name} received'])

    def call(self, service_type: Any, name: str, **fields: Any) -> Any:
        """Call a service of the node; its response."""
        client = self.peer.create_client(service_type, name)
        self.wait(client.service_is_ready)
        future = client.call_async(service_type.Request(**fields))
        self.wait(future.done)
        return future.result()

    def set_parameter(self, name: str, value: Any) -> Any:
        """Set a parameter as another process would; the result with its reason."""
        client = AsyncParameterClient(self.peer, self.node.get_fully_qualified_name())
        self.wait(client.services_are_ready)
        future = client.set_parameters([Parameter(name, value=value)])
        self.wait(future.done)
        return future.result().results[0]

    def complaint(self) -> str:
        """What the node's health complains of; 'OK' when nothing."""
        return self.node.health.report(time.monotonic()).message

    def wait_for_complaint(self, text: str) -> None:
        """Spin until the node complains with this text; the complaints so far otherwise."""
        seen = set()

        def complained() -> bool:
            seen.add(self.complaint())
            return any(text in complaint for complaint in seen)

        try:
            self.wait(complained)
        except AssertionError:
            raise AssertionError(f'no complaint with {text!r}, only {seen}') from None


def header(stamp_ns: int, frame_id: str = 'eye') -> Header:
    """A header with a stamp in nanoseconds."""
    return Header(stamp=to_time(stamp_ns), frame_id=frame_id)


def joint_state(stamp_ns: int, *angles: float) -> JointState:
    """(pan, tilt) at a stamp [ns]; an empty message, 'nothing to say', without angles."""
    names = ['pan', 'tilt'] if angles else []
    return JointState(header=header(stamp_ns), name=names, position=list(angles))
