"""The health of a node: which inputs are silent, and which problems occurred. No ROS."""

import math
from dataclasses import dataclass, field
from enum import IntEnum


class Level(IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


FIRST_MESSAGE_TIMES = 3.0
"""Before its first message an input may be silent so many times as long: nodes are starting."""

START_S = 30.0
"""So long an input without a first message is in the report only: the log of a start is short."""

ANOTHER_MESSAGE_EVERY_S = 60.0
"""Where one place has always another problem to report, one of them is news so often [s]."""


@dataclass
class _Input:
    expected_every_s: float | None
    received: int = 0
    received_at_s: float | None = None
    recent: int = 0


@dataclass
class _Problem:
    level: Level
    message: str
    recorded_at_s: float
    logged_level: int = -1
    logged_message: str = ''
    logged_at_s: float = -math.inf


@dataclass
class Report:
    """One report of a node: the worst level, all problems in one text, and figures."""

    level: Level
    message: str
    values: dict[str, str] = field(default_factory=dict)


class Health:
    """Watches inputs for silence and keeps the last errors; times in seconds, monotonic.

    An error stays in the report for `error_memory_s` after its last occurrence.
    """

    def __init__(self, now_s: float, error_memory_s: float = 5.0) -> None:
        self._started_s = now_s
        self._error_memory_s = error_memory_s
        self._inputs: dict[str, _Input] = {}
        self._problems: dict[str, _Problem] = {}
        self._reported_s = now_s
        self.values: dict[str, str] = {}

    def watch_input(self, name: str, every_s: float | None) -> None:
        """Watch an input; silence for longer than `every_s` is a WARN (None: never)."""
        self._inputs[name] = _Input(every_s)

    def record_message(self, name: str, now_s: float) -> None:
        """Count a message of an input."""
        entry = self._inputs[name]
        entry.received += 1
        entry.recent += 1
        entry.received_at_s = now_s

    def record_problem(
        self,
        where: str,
        message: str,
        now_s: float,
        level: Level = Level.ERROR,
        quiet: bool = False,
    ) -> bool:
        """Record a problem; return True when it is news (so that the log is not flooded).

        A problem lasts while `where` (a topic, a timer, a part of the node) has one again within
        `error_memory_s`. It is news once, and again when it becomes worse, or when it has another
        message than a minute ago; the messages alone may differ each time, as those with figures
        do. A `quiet` problem is never news.
        """
        known = self._problems.get(where)
        if known is None or now_s - known.recorded_at_s > self._error_memory_s:
            known = self._problems[where] = _Problem(level, message, now_s)
        known.level, known.message, known.recorded_at_s = level, message, now_s
        changed = message != known.logged_message
        waited = now_s - known.logged_at_s >= ANOTHER_MESSAGE_EVERY_S
        if quiet or not (level > known.logged_level or (changed and waited)):
            return False
        known.logged_level, known.logged_message, known.logged_at_s = level, message, now_s
        return True

    def clear_problem(self, where: str) -> None:
        """Remove a problem that is over."""
        self._problems.pop(where, None)

    def silent_inputs(self, now_s: float) -> dict[str, float]:
        """Return the inputs that are silent for longer than expected: name -> allowed time [s]."""
        silence = {}
        for name, entry in self._inputs.items():
            if entry.expected_every_s is None:
                continue
            allowed_s, since_s = entry.expected_every_s, entry.received_at_s
            if since_s is None:
                allowed_s, since_s = FIRST_MESSAGE_TIMES * allowed_s, self._started_s
            if now_s - since_s > allowed_s:
                silence[name] = allowed_s
        return silence

    def is_starting(self, name: str, now_s: float) -> bool:
        """Return whether an input may be without a first message because nodes still start."""
        return self._inputs[name].received == 0 and now_s - self._started_s < START_S

    def report(self, now_s: float) -> Report:
        """Return everything in one report; rates are those since the last report."""
        seconds = max(now_s - self._reported_s, 1e-9)
        self._reported_s = now_s
        values = dict(self.values)
        for name, entry in self._inputs.items():
            values[f'{name} received'] = str(entry.received)
            values[f'{name} rate [1/s]'] = f'{entry.recent / seconds:.1f}'
            entry.recent = 0
        self._problems = {
            where: problem
            for where, problem in self._problems.items()
            if now_s - problem.recorded_at_s <= self._error_memory_s
        }
        found = self._problems.values()
        worst = max((problem.level for problem in found), default=Level.OK)
        text = '; '.join(problem.message for problem in found)
        return Report(worst, text or 'OK', values)
