"""Contract with the installed rclpy: each private name that we use exists and behaves as we need.

A failure after an update of rclpy names what `ja_common.rclpy_private` must follow.
"""

import inspect
from collections.abc import Iterator

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import Executor, SingleThreadedExecutor, TimeoutObject
from rclpy.guard_condition import GuardCondition
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

from ja_common.private_context import private_context
from ja_common.rclpy_private import (
    ENTITY_KINDS,
    RCLError,
    StepExecutor,
    UnknownROSArgsError,
    UnspunSubscription,
    WaitSet,
    keep_from_context,
    parameter_names,
    parameter_overrides,
    take_message,
)
from ros_testing import spin_until


@pytest.fixture
def node(ros_context: Context) -> Iterator[Node]:
    node = rclpy.create_node('node', context=ros_context)
    yield node
    node.destroy_node()


@pytest.fixture
def executor(ros_context: Context) -> Iterator[StepExecutor]:
    executor = StepExecutor(context=ros_context)
    yield executor
    executor.shutdown()


def wait_until_ready(wait_set: WaitSet, seconds: int = 5) -> list:
    """Wait; return kinds and entities that are ready."""
    wait_set.wait(seconds * 10**9)
    return list(wait_set.ready_entities())


def test_errors_of_rcl_are_run_time_errors_of_their_own():
    assert issubclass(UnknownROSArgsError, RuntimeError)
    assert issubclass(RCLError, RuntimeError)
    context = Context()
    with pytest.raises(UnknownROSArgsError, match='unknown'):
        rclpy.init(args=['--ros-args', '--unknown'], context=context)
    with pytest.raises(RCLError, match=r'^failed to initialize rcl: .*, at '):
        rclpy.init(args=['--ros-args', '-p', 'x'], context=context)


def test_parameters_of_a_node_are_known_by_name(node):
    node.declare_parameter('b', 1)
    node.declare_parameter('a', 1)
    assert parameter_names(node)[:2] == ['a', 'b']
    assert 'use_sim_time' in parameter_names(node)


def test_what_a_node_was_given_is_known_with_its_value(ros_context):
    given = [Parameter('a', value=1), Parameter('not declared', value='b')]
    node = Node('node', context=ros_context, parameter_overrides=given)
    node.declare_parameter('a', 5)
    assert parameter_overrides(node) == {'a': 1, 'not declared': 'b'}
    node.destroy_node()


def test_a_context_does_not_destroy_a_node_that_is_kept_from_it():
    destroyed = []

    class Kept(Node):
        def destroy_node(self) -> None:
            destroyed.append(self)
            super().destroy_node()

    with private_context() as context:
        node = Kept('node', context=context)
        keep_from_context(node)
    assert destroyed == []
    node.destroy_node()
    assert destroyed == [node]


def test_step_of_a_spin_has_the_signature_that_we_overwrite():
    ours = inspect.signature(StepExecutor._spin_once_impl).parameters
    theirs = inspect.signature(SingleThreadedExecutor._spin_once_impl).parameters
    assert list(ours) == list(theirs) == ['self', 'timeout_sec', 'wait_condition']
    assert [p.kind for p in ours.values()] == [p.kind for p in theirs.values()]
    assert ours['wait_condition'].default() is theirs['wait_condition'].default() is False
    assert TimeoutObject(0.5).timeout == 0.5


def test_spinning_of_rclpy_goes_through_the_step(executor, monkeypatch):
    steps = []
    monkeypatch.setattr(executor, 'spin_step', lambda *step: steps.append(step))
    executor.spin_once(timeout_sec=0.5)
    executor.spin_once_until_future_complete(rclpy.task.Future(), TimeoutObject(0.25))
    assert [timeout_s for timeout_s, _ in steps] == [0.5, 0.25]
    assert not any(condition() for _, condition in steps)


def test_wakers_are_guard_conditions_that_end_a_wait(executor, ros_context):
    own, sigint = executor.wakers()
    assert isinstance(own, GuardCondition)
    assert isinstance(sigint, GuardCondition)
    wait_set = WaitSet([], ENTITY_KINDS, executor.wakers(), [], ros_context)
    executor.wake()
    assert wait_until_ready(wait_set) == []
    wait_set.wait(0)


def test_tasks_run_once_and_with_them_the_callbacks_of_futures(executor):
    calls = []
    executor.create_task(calls.append, 1)
    future = rclpy.task.Future(executor=executor)
    future.add_done_callback(lambda done: calls.append(done.result()))
    future.set_result(2)
    executor.run_tasks()
    executor.run_tasks()
    assert calls == [1, 2]


@pytest.mark.parametrize('kind', [*(k for k in ENTITY_KINDS if k != 'subscription'), 'waitable'])
def test_executor_can_take_from_every_kind_of_entity(kind):
    take = getattr(Executor, f'_take_{kind}')
    assert len(inspect.signature(take).parameters) == 2


def test_wait_set_finds_what_is_ready_of_each_kind(executor, node, ros_context):
    timer = node.create_timer(0.001, lambda: None)
    guard = node.create_guard_condition(lambda: None)
    subscription = node.create_subscription(Int32, 'number', lambda _: None, 10)
    publisher = node.create_publisher(Int32, 'number', 10)
    service = node.create_service(Trigger, 'ask', lambda _, response: response)
    client = node.create_client(Trigger, 'ask')
    wait_set = WaitSet([node], ENTITY_KINDS, executor.wakers(), list(node.waitables), ros_context)
    found = []

    def wait() -> None:
        found.extend(wait_until_ready(wait_set))

    while not (publisher.get_subscription_count() and client.service_is_ready()):
        wait()
    answered = client.call_async(Trigger.Request())
    publisher.publish(Int32(data=7))
    guard.trigger()
    while not {('timer', timer), ('subscription', subscription), ('service', service)} <= set(
        found
    ):
        wait()
    assert ('guard_condition', guard) in found
    with pytest.raises(StopIteration):
        executor.serve('timer', timer).send(None)
    served = executor.serve('service', service)
    with pytest.raises(StopIteration):
        served.send(None)
    while ('client', client) not in found:
        wait()
    with pytest.raises(StopIteration):
        executor.serve('client', client).send(None)
    assert answered.done()


@pytest.mark.parametrize('with_information', [False, True])
def test_message_is_taken_with_the_time_of_its_publishing(node, ros_context, with_information):
    received = []
    if with_information:

        def callback(message: Int32, information: dict) -> None:
            received.append((message.data, information['source_timestamp']))
    else:

        def callback(message: Int32) -> None:
            received.append(message.data)

    subscription = node.create_subscription(Int32, 'number', callback, 10)
    assert subscription._callback_type in Subscription.CallbackType
    publisher = node.create_publisher(Int32, 'number', 10)
    wait_set = WaitSet([node], ['subscription'], [], [], ros_context)
    assert take_message(subscription) == []
    before_ns = node.get_clock().now().nanoseconds
    publisher.publish(Int32(data=7))
    assert wait_until_ready(wait_set) == [('subscription', subscription)]
    ((stamp_ns, call),) = take_message(subscription)
    assert before_ns <= stamp_ns <= node.get_clock().now().nanoseconds
    call()
    assert received == [(7, stamp_ns) if with_information else 7]
    node.destroy_subscription(subscription)
    assert take_message(subscription) == []


def test_subscription_that_no_executor_serves_keeps_its_messages(node, ros_context):
    qos = QoSProfile(depth=2, reliability=ReliabilityPolicy.BEST_EFFORT)
    polled = UnspunSubscription(node, Int32, 'number', qos)
    assert list(node.subscriptions) == []
    publisher = node.create_publisher(Int32, 'number', 10)
    spinner = SingleThreadedExecutor(context=ros_context)
    spin_until(spinner, lambda: polled.publisher_count() and publisher.get_subscription_count())
    for number in range(4):
        publisher.publish(Int32(data=number))
    taken: list = []
    spin_until(spinner, lambda: taken.extend(polled.take_messages()) or len(taken) >= 2)
    stamps_ns = [stamp_ns for _, stamp_ns in taken]
    assert stamps_ns == sorted(stamps_ns)
    assert taken[-1][0].data == 3
    polled.close()
    spin_until(spinner, lambda: not publisher.get_subscription_count())
    spinner.shutdown()


@pytest.mark.parametrize(
    ('kind', 'names'),
    [
        ('WaitSet', ['clear_entities', 'wait', 'get_ready_entities']),
        ('WaitSet', [f'add_{kind}' for kind in ENTITY_KINDS]),
        ('Subscription', ['take_message', 'get_publisher_count', 'destroy_when_not_in_use']),
        ('Timer', ['is_timer_ready']),
    ],
)
def test_handles_have_the_methods_that_we_call(kind, names):
    assert [name for name in names if not hasattr(getattr(rclpy_implementation, kind), name)] == []
