"""A video file, played at the times of its own pictures."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_perception.core.frame_sources import STILL_HZ, SourceError, SourceOptions, Warn
from ja_perception.core.live_sources import shown_url

_LONGEST_WAIT_S = 2.0
# A film may be a little shorter than its header states: lengths are rounded, sound is longer.
_MISSING_SHARE, _MISSING_S = 0.05, 0.5


class FrameTimes:
    """Waits between the pictures of a film, from the times that it states.

    A rate that a file claims is often wrong (1000/s for a variable one): the times count. What
    they ask for is bounded to ``highest_rate_hz`` and 2 s, with a warning.
    """

    def __init__(self, name: str, claimed_hz: float, options: SourceOptions, warn: Warn) -> None:
        self._name, self._options, self._warn = name, options, warn
        usable = math.isfinite(claimed_hz) and 1 <= claimed_hz <= options.highest_rate_hz
        self.usual_s = 1 / (options.rate_hz or (claimed_hz if usable else STILL_HZ))
        """Wait where the times state none [s]."""
        self.real = False
        """Whether the film states times."""

    def wait_s(self, shown_ms: float, next_ms: float) -> float:
        """Return the wait [s] from a picture to the next, with their times in the film [ms]."""
        if self._options.rate_hz:
            return self.usual_s
        wait_s = (next_ms - shown_ms) / 1000
        least_s = 1 / self._options.highest_rate_hz
        if not (math.isfinite(wait_s) and wait_s > 0):
            self._warn(
                'times',
                f"the times of the pictures in '{self._name}' do not increase: it is played at "
                f'{1 / self.usual_s:.0f} pictures/s; set rate_hz for another rate',
            )
            return self.usual_s
        self.real = True
        if wait_s < 0.99 * least_s:
            self._warn(
                'times',
                f"'{self._name}' claims {1 / wait_s:.0f} pictures/s: it is played at "
                f'{1 / least_s:.0f} (highest_rate_hz); set rate_hz if its true rate is another',
            )
            return least_s
        if wait_s > _LONGEST_WAIT_S:
            self._warn(
                'times',
                f"'{self._name}' has a gap of {wait_s:.1f} s at {shown_ms / 1000:.1f} s: the next "
                f'picture comes after {_LONGEST_WAIT_S:g} s',
            )
            return _LONGEST_WAIT_S
        return wait_s


class Film:
    """A video file or a film at an address, which ``opened`` may hold already."""

    def __init__(
        self,
        source: str,
        options: SourceOptions,
        warn: Warn,
        opened: cv2.VideoCapture | None = None,
    ) -> None:
        self._source, self._loop, self._warn = source, options.loop, warn
        self._name = shown_url(source)
        # Through the same back-end each time: another one may count in another way.
        self._capture = cv2.VideoCapture(source) if opened is None else opened
        if not self._capture.isOpened() or not self._capture.grab():
            raise SourceError(
                f"'{self._name}' cannot be read as a video or picture: is it complete, and of a "
                'format that ffplay shows?'
            )
        claimed_hz = self._capture.get(cv2.CAP_PROP_FPS)
        self._claimed_count = self._capture.get(cv2.CAP_PROP_FRAME_COUNT)
        self._length_s = self._claimed_count / claimed_hz if claimed_hz > 0 else 0.0
        self._times = FrameTimes(self._name, claimed_hz, options, warn)
        self._grabbed = True
        self._due_ms = self._capture.get(cv2.CAP_PROP_POS_MSEC)
        self._given = 0
        self.period_s = self._times.usual_s
        self.summary = f"film '{self._name}'"
        if self._length_s > 0:
            self.summary += f', {self._length_s:.1f} s'

    def next_frame(self) -> NDArray[np.uint8] | None:
        """See ``FrameSource``."""
        if not self._grabbed:
            if not self._loop:
                return None
            self._rewind()
        got, bgr = self._capture.retrieve()
        shown_ms = self._due_ms
        self._given += 1
        self._grabbed = self._capture.grab()
        if self._grabbed:
            self._due_ms = self._capture.get(cv2.CAP_PROP_POS_MSEC)
            self.period_s = self._times.wait_s(shown_ms, self._due_ms)
        else:
            self._check_end(shown_ms / 1000 + self.period_s)
        if not got:
            raise SourceError(f"picture {self._given} of '{self._name}' cannot be decoded")
        return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)

    def close(self) -> None:
        """See ``FrameSource``."""
        self._capture.release()

    def _rewind(self) -> None:
        # Opening the film again is exact for every container; seeking is not.
        self._capture.release()
        self._capture = cv2.VideoCapture(self._source)
        if not self._capture.grab():
            raise SourceError(f"'{self._name}' can no longer be read: is the file still there?")
        self._grabbed, self._given = True, 0
        self._due_ms = self._capture.get(cv2.CAP_PROP_POS_MSEC)

    def _check_end(self, end_s: float) -> None:
        """Warn where the film ends before the length that its header states."""
        if self._times.real:
            missing, whole, least = self._length_s - end_s, self._length_s, _MISSING_S
        else:
            missing, whole, least = self._claimed_count - self._given, self._claimed_count, 3
        if missing > max(least, _MISSING_SHARE * whole):
            self._warn(
                'film',
                f"'{self._name}' ends early: nothing can be decoded after picture {self._given} "
                f'({end_s:.1f} s of {self._length_s:.1f} s); is the file complete?',
            )
