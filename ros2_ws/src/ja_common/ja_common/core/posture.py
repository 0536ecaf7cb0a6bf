"""The head's posture at the moment an image was taken, from the stream of joint states."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.geometry import finite_pair
from ja_common.core.joint_track import JointReading, JointTrack

Item = TypeVar('Item')

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

    Each joint has its own samples, so pan and tilt may come at different times and rates. Samples
    that overtook each other are put in order, duplicates are dropped. One that is older by more
    means that the clock was set back: the history starts again from it. No gap of more than half
    a second is bridged.
    """

    def __init__(self, horizon_s: float = 2.0) -> None:
        self._tracks = (JointTrack(horizon_s), JointTrack(horizon_s))

    def record_posture(
        self, stamp_ns: int, position: ArrayLike, velocity: ArrayLike | None = None
    ) -> None:
        """Record a sample: position (2,) [rad], velocity (2,) [rad/s] if the encoder gives it.

        Raises ValueError for values that are not two finite numbers; nothing is then added.
        """
        positions = finite_pair('joint position', position).tolist()
        velocities = [None, None]
        if velocity is not None:
            velocities = finite_pair('joint velocity', velocity).tolist()
        for joint in range(2):
            self.record_joint(joint, stamp_ns, positions[joint], velocities[joint])

    def record_joint(
        self, joint: int, stamp_ns: int, position: float, velocity: float | None = None
    ) -> None:
        """Record a sample of one joint, 0 pan or 1 tilt: position [rad], velocity [rad/s].

        Raises ValueError for a number that is not finite; nothing is then added.
        """
        if self._tracks[joint].is_set_back(stamp_ns):
            self.clear()
        self._tracks[joint].record_sample(stamp_ns, position, velocity)

    def clear(self) -> None:
        """Forget everything."""
        for track in self._tracks:
            track.clear()

    @property
    def newest_stamp_ns(self) -> int | None:
        """Return the newest stamp at which both joints are known; None before."""
        pan, tilt = (track.newest for track in self._tracks)
        return None if pan is None or tilt is None else min(pan.stamp_ns, tilt.stamp_ns)

    @property
    def newest(self) -> Posture | None:
        """Return the latest posture; for an image use `at` with the image's stamp, never this.

        Its stamp is that of the joint whose newest sample is older.
        """
        stamp_ns = self.newest_stamp_ns
        if stamp_ns is None:
            return None
        # Within a gap of the other joint, or before its first sample: its newest one.
        return _posture(stamp_ns, [track.at(stamp_ns) or track.newest for track in self._tracks])

    def at(self, stamp_ns: int) -> Posture | None:
        """Return the posture at a stamp; None outside of what is known (yet), and within a gap."""
        return _posture(stamp_ns, [track.at(stamp_ns) for track in self._tracks])

    def why_unknown(self, stamp_ns: int) -> list[str]:
        """Return for pan and tilt why `at` does not know the joint there; '' where it does."""
        return [track.why_unknown(stamp_ns) for track in self._tracks]

    @property
    def ignores_velocity(self) -> list[bool]:
        """Return for pan and tilt whether the velocity given is 0 also while the joint moves."""
        return [track.ignores_velocity for track in self._tracks]


def _posture(stamp_ns: int, joints: Sequence[JointReading | None]) -> Posture | None:
    pan, tilt = joints
    if pan is None or tilt is None:
        return None
    return Posture(
        stamp_ns,
        np.array([pan.position, tilt.position]),
        np.array([pan.velocity, tilt.velocity]),
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
        newest_ns = self._history.newest_stamp_ns
        if newest_ns is None:
            return None
        stamps = (stamp_ns for stamp_ns, _ in self._waiting)
        return next((i for i, stamp_ns in enumerate(stamps) if stamp_ns <= newest_ns), None)
