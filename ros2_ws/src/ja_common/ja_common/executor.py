"""A single-threaded executor that keeps its wait set, and serves messages as they were said."""

import inspect
import time
from collections import deque
from collections.abc import Callable, Coroutine, Iterator, Sequence
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
_PROMPT_KINDS = _KINDS[:-1]
# The longest that a service waits while messages follow each other.
_PATIENCE_S = 0.02


class CachedWaitSetExecutor(SingleThreadedExecutor):
    """Serves nodes as rclpy's own does, at a fraction of the cost when they are many.

    rclpy's collects all entities before every wait, wakes itself after every callback and wraps
    each in a task; for the whole graph in one process that takes longer than what the nodes
    compute (docs/ros_defaults.md). Here the entities are collected anew only when a node has made
    or destroyed one. And while messages follow each other, only every 20 ms are all waited for:
    most are services, which the graph has many of and hardly anybody asks.

    Messages that are ready together are served in the order in which they were published, on
    whatever topics, so that a cause comes before its effects however late this process wakes:
    without that no run of the graph would repeat another.

    In return, callbacks are plain functions, and entities are made and destroyed in the thread
    that spins. `spin_once` may return without having run a callback when the executor was woken.
    """

    def __init__(self, *, context: Context | None = None) -> None:
        self._wait_sets: tuple[_WaitSet, _WaitSet] | None = None
        self._patient_until_s = 0.0
        self._ready: deque[Callable[[], Any]] = deque()
        super().__init__(context=context)

    def add_node(self, node: Node) -> bool:
        """Serve a node; False when it was served already."""
        self._wait_sets = None
        return super().add_node(node)

    def remove_node(self, node: Node) -> None:
        """Serve it no longer."""
        self._wait_sets = None
        super().remove_node(node)

    def wake(self) -> None:
        """A node has made or destroyed an entity, or the context ends."""
        self._wait_sets = None
        super().wake()

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Stop, and let go of the nodes."""
        self._wait_sets = None
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
        everything, prompt = self._wait_sets = self._wait_sets or self._collect()
        timeout_ns = _FOREVER_NS if timeout_sec is None else int(1e9 * timeout_sec)
        patience_ns = int(1e9 * (self._patient_until_s - time.monotonic()))
        if patience_ns > 0:
            wait_set = prompt
            wait_set.wait(min(timeout_ns, patience_ns) if timeout_ns >= 0 else patience_ns)
        else:
            wait_set = everything
            wait_set.wait(timeout_ns)
            self._patient_until_s = time.monotonic() + _PATIENCE_S
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

    def _collect(self) -> tuple['_WaitSet', '_WaitSet']:
        """Two wait sets: of everything, and of what is served promptly."""
        nodes = sorted(self.get_nodes(), key=Node.get_fully_qualified_name)
        wakers = [self._guard, self._sigint_gc]
        waitables = [waitable for node in nodes for waitable in node.waitables]
        return (
            _WaitSet(nodes, _KINDS, wakers, waitables, self._context),
            _WaitSet(nodes, _PROMPT_KINDS, wakers, [], self._context),
        )

    def _run_tasks(self) -> None:
        """Run what waits for the ends of futures."""
        with self._tasks_lock:
            tasks = list(self._tasks)
            self._tasks.clear()
        for task, _, _ in tasks:
            task()


class _WaitSet:
    """Everything that some nodes wait for; `wait`, then ask for what is `ready`."""

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
        handles: dict[str, list[Any]] = {kind: [] for kind in _KINDS}
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
            for kind in kinds
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
        ready = {kind: set(self._rcl.get_ready_entities(kind)) for kind in self._kinds}
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
