"""A single-threaded executor that keeps its wait set and serves messages in publishing order."""

import inspect
import time
from collections import deque
from collections.abc import Callable, Coroutine
from functools import partial
from operator import itemgetter
from typing import Any

from rclpy.context import Context
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from ja_common.rclpy_private import ENTITY_KINDS, StepExecutor, WaitSet, take_message

_FOREVER_NS = -1
_PROMPT_KINDS = tuple(kind for kind in ENTITY_KINDS if kind != 'service')
# The longest that a service waits while messages follow each other.
_PATIENCE_S = 0.02


class CachedWaitSetExecutor(StepExecutor):
    """Serves nodes as rclpy's own does, at a fraction of the cost when they are many.

    rclpy's collects all entities before every wait, wakes itself after every callback and wraps
    each in a task; for the whole graph in one process that takes longer than what the nodes
    compute (docs/ros_defaults.md). This one collects the entities only after a node has made or
    destroyed one. While messages follow each other, it waits for services only every 20 ms: the
    graph has many of them, and they are rarely called.

    Messages that are ready together are served in the order in which they were published, on all
    topics, so that a cause comes before its effects however late this process wakes. Without that
    order no run of the graph would repeat another.

    In return, callbacks are plain functions, and entities are made and destroyed in the thread
    that spins. `spin_once` may return without having run a callback when the executor was woken.
    """

    def __init__(self, *, context: Context | None = None) -> None:
        self._wait_sets: tuple[WaitSet, WaitSet] | None = None
        self._patient_until_s = 0.0
        self._ready: deque[Callable[[], Any]] = deque()
        super().__init__(context=context)

    def add_node(self, node: Node) -> bool:
        """Serve a node; False when it was served already."""
        self._wait_sets = None
        return super().add_node(node)

    def remove_node(self, node: Node) -> None:
        """Stop serving a node."""
        self._wait_sets = None
        super().remove_node(node)

    def wake(self) -> None:
        """End the wait: a node has made or destroyed an entity, or the context ends."""
        self._wait_sets = None
        super().wake()

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Stop, and let go of the nodes; return False on a timeout."""
        self._wait_sets = None
        self._ready.clear()
        return super().shutdown(timeout_sec)

    def spin_step(self, timeout_s: float | None, wait_condition: Callable[[], bool]) -> None:
        """Serve one thing that is ready; when nothing is, wait for at most `timeout_s` [s]."""
        if not self._ready:
            self.run_tasks()
            if not wait_condition():
                self._wait(timeout_s)
        if self._ready:
            outcome = self._ready.popleft()()
            if inspect.iscoroutine(outcome):
                _run(outcome)

    def _wait(self, timeout_s: float | None) -> None:
        self._check_context()
        everything, prompt = self._wait_sets = self._wait_sets or self._collect()
        timeout_ns = _FOREVER_NS if timeout_s is None else int(1e9 * timeout_s)
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
        for kind, entity in wait_set.ready_entities():
            if kind == 'subscription':
                messages += take_message(entity)
            else:
                self._ready.append(partial(self.serve, kind, entity))
        messages.sort(key=itemgetter(0))
        self._ready.extend(call for _, call in messages)

    def _check_context(self) -> None:
        if not self.context.ok():
            raise ExternalShutdownException

    def _collect(self) -> tuple[WaitSet, WaitSet]:
        """Make two wait sets: of everything, and of what is served promptly."""
        nodes = sorted(self.get_nodes(), key=Node.get_fully_qualified_name)
        wakers = self.wakers()
        waitables = [waitable for node in nodes for waitable in node.waitables]
        return (
            WaitSet(nodes, ENTITY_KINDS, wakers, waitables, self.context),
            WaitSet(nodes, _PROMPT_KINDS, wakers, [], self.context),
        )


def _run(coroutine: Coroutine) -> None:
    """Run a coroutine that has no need to wait."""
    try:
        coroutine.send(None)
    except StopIteration:
        return
    raise TypeError('a callback waits for something: this executor runs plain functions only')
