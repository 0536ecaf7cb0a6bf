"""The head's posture at the moment an image was taken, from the stream of joint states."""

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.geometry import finite_pair
from ja_common.core.stamps import NS_PER_S

Item = TypeVar('Item')

REORDERED_WITHIN_S = 0.25
"""A sample older than the newest by more than this was not overtaken: the clock was set back."""

LONGEST_GAP_S = 0.5
"""Between samples farther apart than this the posture is unknown."""

STILL_BELOW_RAD_S = 0.05
"""Speed [rad/s] below which a joint stands still, the default of every node."""


@dataclass(frozen=True)
class Posture:
    """Posture of the head at a stamp: position and speed of (pan, tilt) [rad, rad/s]."""

    stamp_ns: int
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]

    def is_still(self, still_below_rad_s: float) -> bool:
        """Return whether both joints are slower than the given speed [rad/s]."""
        return all(abs(speed) < still_below_rad_s for speed in self.velocity.tolist())


class PostureHistory:
    """Joint states of the last seconds, interpolated linearly at any stamp among them.

    Samples that overtook each other are put in order, duplicates are dropped. One that is older by
    more means that the clock was set back: the history starts again from it. No gap of more than
    half a second is bridged.
    """

    def __init__(self, horizon_s: float = 2.0) -> None:
        self._horizon_ns = int(horizon_s * NS_PER_S)
        self._stamps: list[int] = []
        self._samples: list[Posture] = []

    def record_posture(
        self, stamp_ns: int, position: ArrayLike, velocity: ArrayLike | None = None
    ) -> None:
        """Record a sample: position (2,) [rad], velocity (2,) [rad/s] if the encoder gives it.

        Raises ValueError for values that are not two finite numbers; nothing is then added.
        """
        position = finite_pair('joint position', position)
        if self._stamps and stamp_ns < self._stamps[-1] - _ns(REORDERED_WITHIN_S):
            self.clear()
        index = bisect_left(self._stamps, stamp_ns)
        if index < len(self._stamps) and self._stamps[index] == stamp_ns:
            return
        if velocity is not None:
            velocity = finite_pair('joint velocity', velocity)
        elif index:
            before = self._samples[index - 1]
            seconds = (stamp_ns - before.stamp_ns) / NS_PER_S
            velocity = (position - before.position) / seconds
        else:
            velocity = np.zeros(2)
        self._stamps.insert(index, stamp_ns)
        self._samples.insert(index, Posture(stamp_ns, position, velocity))
        expired = bisect_left(self._stamps, self._stamps[-1] - self._horizon_ns)
        del self._stamps[:expired], self._samples[:expired]

    def clear(self) -> None:
        """Forget everything."""
        self._stamps.clear()
        self._samples.clear()

    @property
    def newest(self) -> Posture | None:
        """Return the latest sample; for an image use `at` with the image's stamp, never this."""
        return self._samples[-1] if self._samples else None

    def at(self, stamp_ns: int) -> Posture | None:
        """Return the posture at a stamp; None outside of what is known (yet), and within a gap."""
        index = bisect_left(self._stamps, stamp_ns)
        if index == len(self._stamps):
            return None
        after = self._samples[index]
        if after.stamp_ns == stamp_ns:
            return after
        if index == 0:
            return None
        before = self._samples[index - 1]
        if after.stamp_ns - before.stamp_ns > _ns(LONGEST_GAP_S):
            return None
        share = (stamp_ns - before.stamp_ns) / (after.stamp_ns - before.stamp_ns)
        return Posture(
            stamp_ns,
            before.position + share * (after.position - before.position),
            before.velocity + share * (after.velocity - before.velocity),
        )


class PostureJoin(Generic[Item]):
    """Holds stamped items until the posture at their stamp is known, and gives them in order.

    An item whose posture can no longer become known (older than the history, or more than
    `depth` items waiting) is given with None, so that the caller can report it.
    An item from the future (a clock that was set back) waits without holding up the others.
    """

    def __init__(self, history: PostureHistory, depth: int = 32) -> None:
        self._history = history
        self._depth = depth
        self._waiting: list[tuple[int, Item]] = []

    def queue_item(self, stamp_ns: int, item: Item) -> None:
        """Let an item wait for its posture."""
        self._waiting.append((stamp_ns, item))

    def __len__(self) -> int:
        """Return how many items wait."""
        return len(self._waiting)

    def pop_ready(self) -> Iterator[tuple[Item, Posture | None]]:
        """Yield the items whose waiting is over, oldest first; posture None: it stays unknown.

        An item is taken out when it is given: if its handling fails, those after it still wait.
        """
        while (index := self._first_ready()) is not None:
            stamp_ns, item = self._waiting.pop(index)
            yield item, self._history.at(stamp_ns)

    def _first_ready(self) -> int | None:
        if len(self._waiting) > self._depth:
            return 0
        newest = self._history.newest
        if newest is None:
            return None
        stamps = (stamp_ns for stamp_ns, _ in self._waiting)
        return next((i for i, stamp_ns in enumerate(stamps) if stamp_ns <= newest.stamp_ns), None)


def _ns(seconds: float) -> int:
    return int(seconds * NS_PER_S)
