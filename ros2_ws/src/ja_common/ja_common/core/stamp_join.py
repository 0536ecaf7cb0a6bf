"""Waits until one value of each expected topic has come for the same stamp."""

from collections.abc import Iterable
from typing import Any


class StampJoin:
    """Collects one value a key for each stamp, and gives the set when it is complete.

    Sets older than the newest complete one can no longer matter and are dropped, as is, beyond
    `depth`, the incomplete one that was begun first (not that of the lowest stamp: the clock may
    have been set back). A completed stamp that comes again (the same image repeated) starts a new
    set.
    """

    def __init__(self, keys: Iterable[str], depth: int = 32) -> None:
        self._keys = frozenset(keys)
        self._depth = depth
        self._sets: dict[int, dict[str, Any]] = {}

    def collect_value(self, key: str, stamp_ns: int, value: Any) -> dict[str, Any] | None:
        """Add a value; return the complete set {key: value} of its stamp, or None."""
        if key not in self._keys:
            raise KeyError(f'{key!r} is not one of {sorted(self._keys)}')
        collected = self._sets.setdefault(stamp_ns, {})
        collected[key] = value
        if len(collected) == len(self._keys):
            self._sets = {stamp: kept for stamp, kept in self._sets.items() if stamp > stamp_ns}
            return collected
        if len(self._sets) > self._depth:
            del self._sets[next(iter(self._sets))]
        return None

    def missing(self) -> frozenset[str]:
        """Return the keys that the newest set still lacks (all keys when nothing waits)."""
        if not self._sets:
            return self._keys
        return self._keys - self._sets[next(reversed(self._sets))].keys()
