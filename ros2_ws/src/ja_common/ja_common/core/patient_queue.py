"""Items that wait for the posture at their stamp and for the calibration, but not for ever."""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

from ja_common.core.posture import Posture, PostureHistory

Item = TypeVar('Item')


@dataclass(frozen=True)
class _Waiting(Generic[Item]):
    stamp_ns: int
    item: Item
    since_s: float


class PatientQueue(Generic[Item]):
    """Gives every item exactly once, in the order of arrival, with the posture at its stamp.

    An item waits at most ``patience_s`` [s] and then goes on without what it lacks. Where no
    posture (or calibration) has ever come, the patience is spent once, not on every item: the
    camera is then fixed (or uncalibrated), until the first such message comes.
    """

    def __init__(self, postures: PostureHistory, patience_s: float) -> None:
        self._postures = postures
        self._patience_s = patience_s
        self._waiting: deque[_Waiting[Item]] = deque()
        self._fixed = False
        self._uncalibrated = False

    def __len__(self) -> int:
        """Return how many items wait."""
        return len(self._waiting)

    def queue_item(self, stamp_ns: int, item: Item, now_s: float) -> None:
        """Let an item wait; ``now_s`` is a steady time [s]."""
        self._waiting.append(_Waiting(stamp_ns, item, now_s))

    def pop_ready(
        self,
        calibrated: bool,
        now_s: float,
        must_wait: Callable[[int, float], bool] = lambda stamp_ns, waited_s: False,
    ) -> Iterator[tuple[Item, int, Posture | None]]:
        """Yield the items whose waiting is over: item, stamp, posture (None: it stays unknown).

        `must_wait`: for a stamp [ns] and the time waited [s], whether something else is awaited.
        An item is taken out when it is yielded: if its handling fails, those after it still wait.
        """
        while self._waiting:
            first = self._waiting[0]
            if must_wait(first.stamp_ns, now_s - first.since_s):
                break
            impatient = now_s - first.since_s > self._patience_s
            posture = self._postures.at(first.stamp_ns)
            if not impatient and (
                (posture is None and self._posture_may_come(first.stamp_ns))
                or not (calibrated or self._uncalibrated)
            ):
                break
            self._fixed = self._postures.newest_stamp_ns is None
            self._uncalibrated = not calibrated
            self._waiting.popleft()
            yield first.item, first.stamp_ns, posture

    def _posture_may_come(self, stamp_ns: int) -> bool:
        newest_ns = self._postures.newest_stamp_ns
        return not self._fixed if newest_ns is None else newest_ns < stamp_ns
