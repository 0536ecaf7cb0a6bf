"""Where images wait until the posture at their stamp and the calibration are known."""

from collections import deque
from dataclasses import dataclass
from typing import Generic, TypeVar

from ja_common.core.posture import Posture, PostureHistory

Image = TypeVar('Image')


@dataclass(frozen=True)
class _Waiting(Generic[Image]):
    stamp_ns: int
    image: Image
    since_s: float


class WaitingImages(Generic[Image]):
    """Gives every image exactly once, in the order of arrival, with the posture at its stamp.

    An image waits at most ``patience_s`` [s] and then goes on without what it lacks. Where
    nothing was ever heard of postures (or calibration), the patience is spent once, not on every
    image: the camera is then fixed (or uncalibrated), until the first such message comes.
    """

    def __init__(self, postures: PostureHistory, patience_s: float) -> None:
        self._postures = postures
        self._patience_s = patience_s
        self._waiting: deque[_Waiting[Image]] = deque()
        self._fixed = False
        self._uncalibrated = False

    def add(self, stamp_ns: int, image: Image, now_s: float) -> None:
        """Let an image wait; ``now_s`` is a steady time [s]."""
        self._waiting.append(_Waiting(stamp_ns, image, now_s))

    def ready(self, calibrated: bool, now_s: float) -> list[tuple[Image, int, Posture | None]]:
        """Images whose waiting is over: (image, stamp, posture, or None if it stays unknown)."""
        done = []
        while self._waiting:
            first = self._waiting[0]
            impatient = now_s - first.since_s > self._patience_s
            posture = self._postures.at(first.stamp_ns)
            if not impatient and (
                (posture is None and self._posture_may_come(first.stamp_ns))
                or not (calibrated or self._uncalibrated)
            ):
                break
            self._fixed = self._postures.newest is None
            self._uncalibrated = not calibrated
            self._waiting.popleft()
            done.append((first.image, first.stamp_ns, posture))
        return done

    def _posture_may_come(self, stamp_ns: int) -> bool:
        newest = self._postures.newest
        return not self._fixed if newest is None else newest.stamp_ns < stamp_ns
