"""Runs the actions for each image in one order, whatever the order in which messages arrive."""

from collections.abc import Callable, Sequence

Action = Callable[[], None]


class StampOrderedDispatcher:
    """For every image the kinds of messages act in turn, and only then those of the next image.

    Messages of several publishers arrive in any order, even an answer before its question: the
    system may halt a publisher between two of its subscribers. A node with more than one topic
    would then act in another order in every run.

    The first kind opens an image. It waits until all kinds have acted for the image before it, or
    until a further message of the first kind shows that the missing ones will not come. What comes
    later than its turn acts at once.
    """

    def __init__(self, kinds: Sequence[str], depth: int = 32) -> None:
        """No more than `depth` messages wait; beyond that the oldest is dropped."""
        self._kinds = list(kinds)
        self._depth = depth
        self._open_ns: int | None = None
        self._turn = 0  # index of the kind whose turn it is for the open image
        self._waiting: dict[tuple[int, int], Action] = {}

    def queue_action(self, kind: str, stamp_ns: int, action: Action) -> None:
        """Run an action when its turn has come. Raises ValueError for an unknown kind."""
        index = self._kinds.index(kind)
        if index == 0:
            self._open_image(stamp_ns)
        self._waiting[stamp_ns, index] = action
        while (due := self._due()) is not None:
            self._act(due)
        if len(self._waiting) > self._depth:
            del self._waiting[min(self._waiting)]

    def _open_image(self, stamp_ns: int) -> None:
        if self._open_ns is None:
            self._open_ns, self._turn = stamp_ns, 0
        elif stamp_ns < self._open_ns:
            self._waiting.clear()  # the clock was set back
            self._open_ns, self._turn = stamp_ns, 0
        elif stamp_ns > self._open_ns and any(index == 0 for _, index in self._waiting):
            self._turn = len(self._kinds)

    def _due(self) -> tuple[int, int] | None:
        """Return stamp and index of the kind that acts next; None while all have to wait."""
        if self._open_ns is None:
            return None
        due = [key for key in self._waiting if key <= (self._open_ns, self._turn)]
        if not due and self._turn == len(self._kinds):
            due = [key for key in self._waiting if key[1] == 0]
        return min(due, default=None)

    def _act(self, key: tuple[int, int]) -> None:
        stamp_ns, index = key
        action = self._waiting.pop(key)
        if self._open_ns is None or stamp_ns > self._open_ns:
            self._open_ns, self._turn = stamp_ns, 0
        if stamp_ns == self._open_ns:
            self._turn = max(self._turn, index + 1)
        action()
