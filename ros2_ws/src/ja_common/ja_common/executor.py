"""A single-threaded executor that keeps its wait set, and serves messages as they were said."""

import inspect
from collections import deque
from collections.abc import Callable, Coroutine, Iterator
from functools import partial
from operator import itemgetter
from typing import Any

from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor, TimeoutObject
from rclpy.impl.implementation_singleton import rclpy_implementation as implementation
from rclpy.node import Node
from rclpy.subscription import Subscription
from rclpy.waitable import NumberOfEntities

_FOREVER_NS = -1
# As rclpy's C++ names what can be waited for, in the order in which a node's are served.
_KINDS = ('timer', 'subscription', 'guard_condition', 'client', 'service')


class KeptWaitSetExecutor(SingleThreadedExecutor):
    """Serves nodes as rclpy's own does, at a fraction of the cost when they are many.

    rclpy's collects all entities before every wait, wakes itself after every callback and wraps
    each in a task; for the whole graph in one process that takes longer than what the nodes
    compute (docs/ros_defaults.md). Here the entities are collected anew only when a node has made
    or destroyed one.

    Messages that are ready together are served in the order in which they were published, on
    whatever topics, so that a cause comes before its effects however late this process wakes:
    without that no run of the graph would repeat another.

    In return, callbacks are plain functions, and entities are made and destroyed in the thread
    that spins. `spin_once` may return without having run a callback when the executor was woken.
    """

    def __init__(self, *, context: Context | None = None) -> None:
        self._wait_set: _WaitSet | None = None
        self._ready: deque[Callable[[], Any]] = deque()
        super().__init__(context=context)

    def add_node(self, node: Node) -> bool:
        """Serve a node; False when it was served already."""
        self._wait_set = None
        return super().add_node(node)

    def remove_node(self, node: Node) -> None:
        """Serve it no longer."""
        self._wait_set = None
        super().remove_node(node)

    def wake(self) -> None:
        """A node has made or destroyed an entity, or the context ends."""
        self._wait_set = None
        super().wake()

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Stop, and let go of the nodes."""
        self._wait_set = None
        self._ready.clear()
        return super().shutdown(timeout_sec)

    def _spin_once_impl(
        self,
        timeout_sec: float | TimeoutObject | None = None,
        wait_condition: Callable[[], bool] = lambda: False,
    ) -> None:
        if isinstance(timeout_sec, TimeoutObject):
            timeout_sec = timeout_sec.timeout
        if not self._ready:
            self._run_tasks()
            if not wait_condition():
                self._wait(timeout_sec)
        if self._ready:
            outcome = self._ready.popleft()()
            if inspect.iscoroutine(outcome):
                _run(outcome)

    def _wait(self, timeout_sec: float | None) -> None:
        self._check_context()
        wait_set = self._wait_set or self._collect()
        self._wait_set = wait_set
        forever = timeout_sec is None or timeout_sec < 0.0
        wait_set.wait(_FOREVER_NS if forever else int(1e9 * timeout_sec))  # type: ignore[operator]
        self._check_context()
        messages = []
        for kind, entity in wait_set.ready():
            if kind == 'subscription':
                messages += _taken(entity)
            else:
                self._ready.append(partial(self._serve, kind, entity))
        messages.sort(key=itemgetter(0))
        self._ready.extend(call for _, call in messages)

    def _serve(self, kind: str, entity: Any) -> Any:
        work = getattr(self, f'_take_{kind}')(entity)
        return None if work is None else work()

    def _check_context(self) -> None:
        if not self._context.ok():
            raise ExternalShutdownException

    def _collect(self) -> '_WaitSet':
        nodes = sorted(self.get_nodes(), key=Node.get_fully_qualified_name)
        return _WaitSet(nodes, [self._guard, self._sigint_gc], self._context)

    def _run_tasks(self) -> None:
        """Run what waits for the ends of futures."""
        with self._tasks_lock:
            tasks = list(self._tasks)
            self._tasks.clear()
        for task, _, _ in tasks:
            task()


class _WaitSet:
    """Everything that some nodes wait for; `wait`, then ask for what is `ready`."""

    def __init__(self, nodes: list[Node], wakers: list[Any], context: Context) -> None:
        self._entities: list[tuple[str, int, Any]] = []
        handles: dict[str, list[Any]] = {kind: [] for kind in _KINDS}
        self._waitables: list[Any] = []
        for node in nodes:
            for kind in _KINDS:
                for entity in getattr(node, 'guards' if kind == 'guard_condition' else f'{kind}s'):
                    handles[kind].append(entity.handle)
                    self._entities.append((kind, entity.handle.pointer, entity))
            self._waitables += node.waitables
        handles['guard_condition'] += [waker.handle for waker in wakers]
        count = sum(
            (waitable.get_num_entities() for waitable in self._waitables),
            NumberOfEntities(
                *(len(handles[kind]) for kind in
                  ('subscription', 'guard_condition', 'timer', 'client', 'service'))
            ),
        )  # fmt: skip
        self._rcl = implementation.WaitSet(
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
            for kind in _KINDS
            for handle in handles[kind]
        ]

    def wait(self, timeout_ns: int) -> None:
        """Until something is ready, at most `timeout_ns` (negative: for ever)."""
        self._rcl.clear_entities()  # rcl takes out of the set what was not ready
        for add, handle in self._handles:
            add(handle)
        for waitable in self._waitables:
            waitable.add_to_wait_set(self._rcl)
        self._rcl.wait(timeout_ns)

    def ready(self) -> Iterator[tuple[str, Any]]:
        """Kinds and entities that have something to do, after a wait."""
        for waitable in self._waitables:
            if waitable.is_ready(self._rcl):
                yield 'waitable', waitable
        ready = {kind: set(self._rcl.get_ready_entities(kind)) for kind in _KINDS}
        for kind, pointer, entity in self._entities:
            if pointer in ready[kind] and (kind != 'timer' or entity.handle.is_timer_ready()):
                yield kind, entity


def _taken(subscription: Subscription) -> list[tuple[int, Callable[[], Any]]]:
    """The message of a subscription: when it was published [ns], and the call that serves it."""
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


def _run(coroutine: Coroutine) -> None:
    """Run a coroutine that has no need to wait."""
    try:
        coroutine.send(None)
    except StopIteration:
        return
    raise TypeError('a callback waits for something: this executor runs plain functions only')
