"""All that this project uses of rclpy beyond its public API; no other module does.

After an update of rclpy, `tests/ja_common/test_rclpy_private.py` shows what has changed.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import SingleThreadedExecutor, TimeoutObject
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from rclpy.type_support import check_for_type_support
from rclpy.waitable import NumberOfEntities

UnknownROSArgsError = rclpy_implementation.UnknownROSArgsError
"""Raised by `rclpy.init` for ROS arguments that rcl does not know."""

RCLError = rclpy_implementation.RCLError
"""Raised for an error of rcl; its text ends with places in rcl's source files."""

# As rclpy's C++ names what can be waited for, in the order in which a node's are served.
ENTITY_KINDS = ('timer', 'subscription', 'guard_condition', 'client', 'service')


def parameter_names(node: Node) -> list[str]:
    """Return the names of all parameters that a node has declared, sorted."""
    return sorted(node._parameters)


def parameter_overrides(node: Node) -> dict[str, Any]:
    """Return the parameters that a node was given at its start, declared or not, with values."""
    return {name: given.value for name, given in node._parameter_overrides.items()}


def keep_from_context(node: Node) -> None:
    """Leave the end of a node to its owner, as rclpy 7 does.

    A context of rclpy 9 destroys the nodes that it knows when it is shut down: those whose
    constructor has failed as well, and others before their owner has ended them.
    """
    untrack = getattr(node.context, 'untrack_node', None)
    if untrack is not None:
        untrack(node)


class StepExecutor(SingleThreadedExecutor):
    """rclpy's executor without its waiting: a subclass waits and serves in `spin_step`."""

    def spin_step(self, timeout_s: float | None, wait_condition: Callable[[], bool]) -> None:
        """Wait for at most `timeout_s` [s] (None: no limit), and serve what is ready."""
        raise NotImplementedError

    def wakers(self) -> list[Any]:
        """Return the guard conditions that must end a wait: the executor's own, and SIGINT's."""
        return [self._guard, self._sigint_gc]

    def run_tasks(self) -> None:
        """Run the callbacks of the futures that are done."""
        with self._tasks_lock:
            tasks = list(self._tasks)
            self._tasks.clear()
        for task, _, _ in tasks:
            task()

    def serve(self, kind: str, entity: Any) -> Any:
        """Take what an entity of a kind offers, and call its callback; return the coroutine."""
        work = getattr(self, f'_take_{kind}')(entity)
        return None if work is None else work()

    def _spin_once_impl(
        self,
        timeout_sec: float | TimeoutObject | None = None,
        wait_condition: Callable[[], bool] = lambda: False,
    ) -> None:
        if isinstance(timeout_sec, TimeoutObject):
            timeout_sec = timeout_sec.timeout
        self.spin_step(timeout_sec, wait_condition)


class WaitSet:
    """Everything that some nodes wait for: `wait`, then ask for the `ready_entities`."""

    def __init__(
        self,
        nodes: list[Node],
        kinds: Sequence[str],
        wakers: list[Any],
        waitables: list[Any],
        context: Context,
    ) -> None:
        self._kinds = kinds
        self._waitables = waitables
        self._entities: list[tuple[str, int, Any]] = []
        handles: dict[str, list[Any]] = {kind: [] for kind in ENTITY_KINDS}
        for node in nodes:
            for kind in kinds:
                for entity in getattr(node, 'guards' if kind == 'guard_condition' else f'{kind}s'):
                    handles[kind].append(entity.handle)
                    self._entities.append((kind, entity.handle.pointer, entity))
        handles['guard_condition'] += [waker.handle for waker in wakers]
        count = sum(
            (waitable.get_num_entities() for waitable in self._waitables),
            NumberOfEntities(
                *(len(handles[kind]) for kind in
                  ('subscription', 'guard_condition', 'timer', 'client', 'service'))
            ),
        )  # fmt: skip
        self._rcl = rclpy_implementation.WaitSet(
            count.num_subscriptions,
            count.num_guard_conditions,
            count.num_timers,
            count.num_clients,
            count.num_services,
            count.num_events,
            context.handle,
        )
        self._handles = [
            (getattr(self._rcl, f'add_{kind}'), handle)
            for kind in kinds
            for handle in handles[kind]
        ]

    def wait(self, timeout_ns: int) -> None:
        """Wait until something is ready, for at most `timeout_ns` (negative: no limit)."""
        self._rcl.clear_entities()  # rcl takes out of the set what was not ready
        for add, handle in self._handles:
            add(handle)
        for waitable in self._waitables:
            waitable.add_to_wait_set(self._rcl)
        self._rcl.wait(timeout_ns)

    def ready_entities(self) -> Iterator[tuple[str, Any]]:
        """Yield kind and entity of all that is ready after a wait."""
        for waitable in self._waitables:
            if waitable.is_ready(self._rcl):
                yield 'waitable', waitable
        ready = {kind: set(self._rcl.get_ready_entities(kind)) for kind in self._kinds}
        for kind, pointer, entity in self._entities:
            if pointer in ready[kind] and (kind != 'timer' or entity.handle.is_timer_ready()):
                yield kind, entity


def take_message(subscription: Subscription) -> list[tuple[int, Callable[[], Any]]]:
    """Take a message: [(time of publishing [ns], call that serves it)]; [] where there is none."""
    try:
        with subscription.handle:
            taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
    except InvalidHandle:
        return []  # destroyed meanwhile
    if taken is None:
        return []
    message, information = taken
    wants_both = subscription._callback_type is Subscription.CallbackType.WithMessageInfo
    arguments = taken if wants_both else (message,)
    return [(information['source_timestamp'], partial(subscription.callback, *arguments))]


class UnspunSubscription:
    """A subscription that its node does not know of, so that no executor waits for it."""

    def __init__(self, node: Node, message_type: type, topic: str, qos: QoSProfile) -> None:
        check_for_type_support(message_type)
        self._type = message_type
        with node.handle:
            self._handle = rclpy_implementation.Subscription(
                node.handle, message_type, topic, qos.get_c_qos_profile()
            )

    def publisher_count(self) -> int:
        """Return how many publishers are connected."""
        with self._handle:
            return self._handle.get_publisher_count()

    def take_messages(self) -> list[tuple[Any, int]]:
        """Take what waits, oldest first: (message, time of publishing [ns])."""
        taken = []
        with self._handle:
            while (found := self._handle.take_message(self._type, False)) is not None:
                message, information = found
                taken.append((message, information['source_timestamp']))
        return taken

    def close(self) -> None:
        """Unsubscribe."""
        self._handle.destroy_when_not_in_use()
