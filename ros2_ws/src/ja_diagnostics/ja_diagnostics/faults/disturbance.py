"""The effect of a bad driver or link on a stream of messages: silence, delay, disorder."""

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Disturbance:
    """A queue that forwards messages at once, never, later, or in pairs in the wrong order."""

    silent: bool = False
    delay_s: float = 0.0
    swapped: bool = False
    _waiting: list[tuple[float, int, Any]] = field(default_factory=list)
    _count: int = 0
    _overtaken: Any = None

    def queue_message(self, message: Any, now_s: float) -> None:
        """Queue a message that arrives at a time [s] of a clock that only runs forward."""
        if self.silent:
            return
        if self.swapped and self._overtaken is None:
            self._overtaken = message
            return
        self._schedule(message, now_s)
        if self._overtaken is not None:
            overtaken, self._overtaken = self._overtaken, None
            self._schedule(overtaken, now_s)

    def pop_due(self, now_s: float) -> Iterator[Any]:
        """Yield the messages that go out now, in their order."""
        while self._waiting and self._waiting[0][0] <= now_s:
            yield heapq.heappop(self._waiting)[-1]

    @property
    def next_due_s(self) -> float | None:
        """Return when the next message goes out [s]; None while none waits."""
        return self._waiting[0][0] if self._waiting else None

    def _schedule(self, message: Any, now_s: float) -> None:
        self._count += 1  # messages that are due together keep their order
        heapq.heappush(self._waiting, (now_s + self.delay_s, self._count, message))
