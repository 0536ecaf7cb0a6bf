"""Pictures from a webcam, or from a camera in the network."""

import threading
import time
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit, urlunsplit

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_perception.core.frame_sources import STILL_HZ, NotYetError, SourceError, SourceOptions

_OPEN_MS, _READ_MS = 10_000, 5_000
_LOOK_EVERY_S = 0.005
_SILENT_AFTER_S = 2.0
_RETRY_S = 1.0


class Device:
    """A webcam, by number ('0') or path ('/dev/video0')."""

    def __init__(self, source: str, options: SourceOptions) -> None:
        self._source = source
        if source.startswith('/dev/') and not Path(source).exists():
            raise SourceError(f"no such device: '{source}'")
        self._capture = cv2.VideoCapture(int(source) if source.isdigit() else source)
        if not self._capture.isOpened():
            raise SourceError(
                f"camera '{source}' cannot be opened: is it connected, allowed to you, and not in "
                'use by another program?'
            )
        own_hz = self._capture.get(cv2.CAP_PROP_FPS)
        rate_hz = options.rate_hz or (own_hz if own_hz > 0 else STILL_HZ)
        self.period_s = 1 / min(rate_hz, options.highest_rate_hz)
        self.summary = f"camera '{source}'"

    def next_frame(self) -> NDArray[np.uint8] | None:
        """See ``FrameSource``."""
        got, bgr = self._capture.read()
        if not got:
            raise SourceError(
                f"camera '{self._source}' delivers no more pictures: is it unplugged?"
            )
        return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)

    def close(self) -> None:
        """See ``FrameSource``."""
        self._capture.release()


class Stream:
    """A network camera (RTSP, HTTP): its newest picture; opened again when it breaks off.

    A thread reads all the time, or old pictures would pile up on the way.
    """

    def __init__(
        self,
        url: str,
        options: SourceOptions,
        capture: cv2.VideoCapture,
        reopen: Callable[[str], cv2.VideoCapture] | None = None,
    ) -> None:
        self._url = url
        self._reopen = reopen or capture_url
        self._least_s = 1 / (options.rate_hz or options.highest_rate_hz)
        self.summary = f"stream '{shown_url(url)}'"
        self.period_s = _LOOK_EVERY_S
        self._newest: NDArray[np.uint8] | None = None
        self._given_s = self._arrived_s = time.monotonic()
        self._why = ''
        self._closed = threading.Event()
        self._thread = threading.Thread(
            target=self._read_all, args=(capture,), name='stream', daemon=True
        )
        self._thread.start()

    def next_frame(self) -> NDArray[np.uint8] | None:
        """See ``FrameSource``; live, so it never ends."""
        now_s = time.monotonic()
        bgr, self._newest = self._newest, None
        if bgr is None:
            silent_s = now_s - self._arrived_s
            self.period_s = _LOOK_EVERY_S
            if silent_s > _SILENT_AFTER_S:
                self.period_s = _SILENT_AFTER_S / 4
                why = self._why or 'is the camera or its network busy?'
                raise SourceError(f'{self.summary} gives no picture for {silent_s:.0f} s: {why}')
            raise NotYetError()
        self.period_s = max(_LOOK_EVERY_S, self._least_s)
        return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)

    def close(self) -> None:
        """See ``FrameSource``."""
        self._closed.set()
        self._thread.join(2 * _READ_MS / 1000)

    def _read_all(self, capture: cv2.VideoCapture) -> None:
        while not self._closed.is_set():
            got, bgr = capture.read()
            if got:
                self._newest, self._arrived_s, self._why = bgr, time.monotonic(), ''
                continue
            capture.release()
            self._why = 'it has broken off, and is opened again'
            self._closed.wait(_RETRY_S)
            while not self._closed.is_set():
                try:
                    capture = self._reopen(self._url)
                    break
                except SourceError as error:
                    self._why = str(error)
                    self._closed.wait(_RETRY_S)
        capture.release()


def capture_url(url: str) -> cv2.VideoCapture:
    """Open an address with OpenCV's FFmpeg. Raises ``SourceError``."""
    capture = cv2.VideoCapture(
        url,
        cv2.CAP_FFMPEG,
        [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, _OPEN_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, _READ_MS],
    )
    if not capture.isOpened():
        raise SourceError(
            f"'{shown_url(url)}' cannot be opened: are the address, name and password right, does "
            "the camera answer, and does ffplay show it (OpenCV's FFmpeg must know its format)?"
        )
    return capture


def shown_url(url: str) -> str:
    """Return a source for logs: an address without its user name, password and query."""
    if '://' not in url:
        return url
    parts = urlsplit(url)
    host = parts.netloc.rpartition('@')[2]
    return urlunsplit((parts.scheme, host, parts.path, '', ''))
