"""The newest messages of one topic, to find the one that belongs to the stamp of another."""

from collections import deque
from typing import Generic, TypeVar

from ja_common.core.stamps import NS_PER_S

Item = TypeVar('Item')


class StampBuffer(Generic[Item]):
    """Finds the item of a stamp, or the nearest one within a tolerance.

    Items come in the order of their stamps, from a source of its own: one for a stamp may still
    come while all that came are older. It is waited for at most ``patience_s`` [s]. Where it then
    has not come, the patience is spent, and not again for every stamp, until the next item comes.
    """

    def __init__(self, within_s: float, patience_s: float, depth: int = 8) -> None:
        self._within_ns = within_s * NS_PER_S
        self._patience_s = patience_s
        self._items: deque[tuple[int, Item]] = deque(maxlen=depth)
        self._absent = False

    def record_item(self, stamp_ns: int, item: Item) -> None:
        """Keep an item; the oldest one is dropped."""
        self._items.append((stamp_ns, item))
        self._absent = False

    def must_wait(self, stamp_ns: int, waited_s: float) -> bool:
        """Return whether the item of a stamp may still come, after a wait of so long [s]."""
        # The last one that came, not the highest stamp: the clock may have been set back.
        came = bool(self._items) and (
            self._items[-1][0] >= stamp_ns or any(stamp == stamp_ns for stamp, _ in self._items)
        )
        if came or self._absent:
            return False
        self._absent = waited_s > self._patience_s
        return not self._absent

    def nearest(self, stamp_ns: int) -> Item | None:
        """Return the item nearest to a stamp; None where none is within the tolerance."""
        if not self._items:
            return None
        # The newest of those that are equally near: it may have been sent again.
        stamp, item = min(reversed(self._items), key=lambda each: abs(each[0] - stamp_ns))
        return item if abs(stamp - stamp_ns) <= self._within_ns else None

    def seconds_off(self, stamp_ns: int) -> float | None:
        """Return how far the nearest item is from a stamp [s]; None where none has come."""
        if not self._items:
            return None
        return min(abs(stamp - stamp_ns) for stamp, _ in self._items) / NS_PER_S
