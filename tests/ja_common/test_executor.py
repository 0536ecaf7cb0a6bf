"""The executor that keeps its wait set serves all that rclpy's serves."""

from collections.abc import Iterator

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

from ja_common.executor import CachedWaitSetExecutor
from ros_testing import spin_until


@pytest.fixture
def executor(ros_context: Context) -> Iterator[CachedWaitSetExecutor]:
    executor = CachedWaitSetExecutor(context=ros_context)
    yield executor
    nodes = executor.get_nodes()
    executor.shutdown()
    for node in nodes:
        node.destroy_node()


@pytest.fixture
def node(executor: CachedWaitSetExecutor, ros_context: Context) -> Node:
    node = rclpy.create_node('node', context=ros_context)
    executor.add_node(node)
    return node


def test_messages_timers_and_services_are_served(executor, node):
    received, beats = [], []
    node.create_subscription(Int32, 'number', lambda message: received.append(message.data), 10)
    publisher = node.create_publisher(Int32, 'number', 10)
    node.create_timer(0.01, lambda: beats.append(len(beats)))

    def answer(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = 'here'
        return response

    node.create_service(Trigger, 'ask', answer)
    client = node.create_client(Trigger, 'ask')
    spin_until(executor, client.service_is_ready)
    future, texts = client.call_async(Trigger.Request()), []
    future.add_done_callback(lambda done: texts.append(done.result().message))
    for number in range(5):
        publisher.publish(Int32(data=number))
    spin_until(executor, lambda: len(received) == 5 and len(beats) > 3 and texts)
    assert received == [0, 1, 2, 3, 4]
    assert texts == ['here']


def test_entity_that_a_callback_makes_or_destroys_is_noticed(executor, node):
    received, beats = [], []

    def begin() -> None:
        node.destroy_timer(timer)
        beats.append('begin')
        node.create_subscription(Int32, 'late', lambda message: received.append(message.data), 10)

    timer = node.create_timer(0.001, begin)
    publisher = node.create_publisher(Int32, 'late', 10)
    spin_until(executor, publisher.get_subscription_count)
    publisher.publish(Int32(data=7))
    spin_until(executor, lambda: received)
    assert received == [7]
    assert beats == ['begin']


def test_a_node_may_come_and_go(executor, node, ros_context):
    received = []
    publisher = node.create_publisher(Int32, 'number', 10)
    guest = rclpy.create_node('guest', context=ros_context)
    guest.create_subscription(Int32, 'number', lambda message: received.append(message.data), 10)
    executor.add_node(guest)
    spin_until(executor, publisher.get_subscription_count)
    publisher.publish(Int32(data=1))
    spin_until(executor, lambda: received)
    executor.remove_node(guest)
    publisher.publish(Int32(data=2))
    for _ in range(10):
        executor.spin_once(timeout_sec=0.01)
    assert received == [1]
    guest.destroy_node()


def test_messages_are_served_in_the_order_in_which_they_were_published(executor, node):
    names, order = ['bravo', 'charlie', 'alpha'], []
    publishers = {}
    for name in sorted(names):
        node.create_subscription(Int32, name, lambda _, name=name: order.append(name), 10)
        publishers[name] = node.create_publisher(Int32, name, 10)
    spin_until(executor, lambda: all(p.get_subscription_count() for p in publishers.values()))
    for _ in range(20):
        order.clear()
        for name in names:
            publishers[name].publish(Int32())
        spin_until(executor, lambda: len(order) == 3)
        assert order == names
        names.append(names.pop(0))


def test_a_fault_of_a_callback_is_raised_and_one_that_waits_is_refused(executor, node):
    def fail() -> None:
        raise ZeroDivisionError

    timer = node.create_timer(0.001, fail)
    with pytest.raises(ZeroDivisionError):
        spin_until(executor, lambda: False)
    node.destroy_timer(timer)

    async def wait() -> None:
        await rclpy.task.Future()

    node.create_timer(0.001, wait)
    with pytest.raises(TypeError, match='plain functions only'):
        spin_until(executor, lambda: False)


def test_the_end_of_the_context_ends_the_spinning(executor, node, ros_context):
    node.create_timer(0.001, ros_context.shutdown)
    with pytest.raises(ExternalShutdownException):
        spin_until(executor, lambda: False)


def test_a_service_is_served_while_messages_follow_each_other(executor, node):
    received = []

    def publish_another(message: Int32) -> None:
        received.append(message.data)
        publisher.publish(Int32(data=message.data + 1))

    node.create_subscription(Int32, 'number', publish_another, 10)
    publisher = node.create_publisher(Int32, 'number', 10)
    node.create_service(Trigger, 'ask', lambda _, response: response)
    client = node.create_client(Trigger, 'ask')
    spin_until(executor, client.service_is_ready)
    publisher.publish(Int32(data=0))
    spin_until(executor, lambda: len(received) > 100)
    answered = client.call_async(Trigger.Request())
    spin_until(executor, answered.done)
    assert received == list(range(len(received)))
