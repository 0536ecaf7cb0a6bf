"""One joint in the last seconds: its position and speed, interpolated at any stamp among them."""

import math
from bisect import bisect_left
from typing import NamedTuple

from ja_common.core.stamps import NS_PER_S

REORDERED_WITHIN_S = 0.25
"""A sample older than the newest by more than this was not overtaken: the clock was set back."""

LONGEST_GAP_S = 0.5
"""Between samples farther apart than this the position is unknown."""

# A joint that has come so far [rad], in so many steps of one direction, was moving.
_MOTION_RAD = 0.05
_MOTION_STEPS = 8


class JointReading(NamedTuple):
    """Position [rad] and speed [rad/s] of one joint at a stamp."""

    stamp_ns: int
    position: float
    velocity: float


class JointTrack:
    """The samples of one joint. Those that overtook each other are put in order.

    A speed that is not given is the difference to the sample before.
    """

    def __init__(self, horizon_s: float) -> None:
        self._horizon_ns = int(horizon_s * NS_PER_S)
        self._stamps: list[int] = []
        self._samples: list[JointReading] = []
        self._speed_watch = _SpeedWatch()

    @property
    def newest(self) -> JointReading | None:
        """Return the latest sample."""
        return self._samples[-1] if self._samples else None

    @property
    def oldest(self) -> JointReading | None:
        """Return the first sample that is kept."""
        return self._samples[0] if self._samples else None

    @property
    def ignores_velocity(self) -> bool:
        """Return whether the velocity given is no measurement: always 0, also in motion."""
        return self._speed_watch.is_placeholder

    def is_set_back(self, stamp_ns: int) -> bool:
        """Return whether a sample of this stamp shows that the clock was set back."""
        return bool(self._stamps) and stamp_ns < self._stamps[-1] - _ns(REORDERED_WITHIN_S)

    def record_sample(self, stamp_ns: int, position: float, velocity: float | None) -> None:
        """Record a sample; one of a stamp that is known is dropped.

        Raises ValueError for a number that is not finite; nothing is then added.
        """
        if not math.isfinite(position):
            raise ValueError(f'its position is not finite: {position}')
        if velocity is not None and not math.isfinite(velocity):
            raise ValueError(f'its velocity is not finite: {velocity}')
        index = bisect_left(self._stamps, stamp_ns)
        if index < len(self._stamps) and self._stamps[index] == stamp_ns:
            return
        if velocity is None or self._speed_watch.is_useless(position, velocity):
            velocity = 0.0
            if index:
                before = self._samples[index - 1]
                velocity = (position - before.position) / ((stamp_ns - before.stamp_ns) / NS_PER_S)
        self._stamps.insert(index, stamp_ns)
        self._samples.insert(index, JointReading(stamp_ns, position, velocity))
        expired = bisect_left(self._stamps, self._stamps[-1] - self._horizon_ns)
        del self._stamps[:expired], self._samples[:expired]

    def clear(self) -> None:
        """Forget all samples."""
        self._stamps.clear()
        self._samples.clear()

    def at(self, stamp_ns: int) -> JointReading | None:
        """Return the joint at a stamp; None outside of what is known (yet), and within a gap."""
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
        return JointReading(
            stamp_ns,
            before.position + share * (after.position - before.position),
            before.velocity + share * (after.velocity - before.velocity),
        )

    def why_unknown(self, stamp_ns: int) -> str:
        """Return why `at` knows nothing at this stamp; '' where it knows the joint."""
        if self.at(stamp_ns) is not None:
            return ''
        oldest, newest = self.oldest, self.newest
        if oldest is None or newest is None:
            return 'no position has come'
        if stamp_ns > newest.stamp_ns:
            return f'its newest position is {_seconds(stamp_ns - newest.stamp_ns)} older'
        if stamp_ns < oldest.stamp_ns:
            return f'its oldest position is {_seconds(oldest.stamp_ns - stamp_ns)} newer'
        return f'its positions are more than {LONGEST_GAP_S} s apart'


class _SpeedWatch:
    """Tells a joint that stands still from a driver that fills in 0 for a speed it cannot measure.

    One speed other than 0 shows that it is measured, for good.
    """

    def __init__(self) -> None:
        self.is_placeholder = False
        self._is_measured = False
        self._steps = 0
        self._from: float | None = None
        self._last = 0.0

    def is_useless(self, position: float, velocity: float) -> bool:
        if self._is_measured:
            return False
        if velocity != 0.0:
            self._is_measured, self.is_placeholder = True, False
            return False
        if not self.is_placeholder:
            self._follow(position)
        return self.is_placeholder

    def _follow(self, position: float) -> None:
        step = position - self._last
        if self._from is None:
            self._from = position
        elif step * (self._last - self._from) < 0.0:  # it turns round, or an encoder flickers
            self._from, self._steps = self._last, 1
        elif step != 0.0:
            self._steps += 1
        self._last = position
        self.is_placeholder = (
            self._steps >= _MOTION_STEPS and abs(position - self._from) > _MOTION_RAD
        )


def _ns(seconds: float) -> int:
    return int(seconds * NS_PER_S)


def _seconds(duration_ns: int) -> str:
    return f'{duration_ns / NS_PER_S:.3g} s'
