"""What a bad driver or link does to a stream of messages: silence, delay, disorder."""

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Disturbance:
    """Hands messages on: as they come, or not, or later, or in pairs the wrong way round."""

    silent: bool = False
    delay_s: float = 0.0
    swapped: bool = False
    _waiting: list[tuple[float, int, Any]] = field(default_factory=list)
    _count: int = 0
    _overtaken: Any = None

    def put(self, message: Any, now_s: float) -> None:
        """A message comes in, at a time [s] of a clock that runs forward."""
        if self.silent:
            return
        if self.swapped and self._overtaken is None:
            self._overtaken = message
            return
        self._hand_on(message, now_s)
        if self._overtaken is not None:
            overtaken, self._overtaken = self._overtaken, None
            self._hand_on(overtaken, now_s)

    def due(self, now_s: float) -> Iterator[Any]:
        """The messages that go out now, in their order."""
        while self._waiting and self._waiting[0][0] <= now_s:
            yield heapq.heappop(self._waiting)[-1]

    def _hand_on(self, message: Any, now_s: float) -> None:
        self._count += 1  # those that are due together keep their order
        heapq.heappush(self._waiting, (now_s + self.delay_s, self._count, message))
