"""The folder of a meeting: its file, its pictures and its report, written by another thread."""

import threading
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_caregiver.core.meeting import Meeting, save_meeting
from ja_common.core.files import write_file

PICTURES = 'pictures'
_WIDEST_PX = 480
_QUALITY = 80
# As many as a long meeting has; a disk that stays full must not fill the memory.
_MOST_WAITING = 200

ReportWriter = Callable[[Meeting, Path], Path]


def new_meeting(source: str, seed: int, learner: str) -> Meeting:
    """Return a meeting that starts now."""
    return Meeting(time.strftime('%Y-%m-%dT%H:%M:%S%z'), source, seed, learner)


def write_report(meeting: Meeting, folder: Path) -> Path:
    """Write the report of a meeting; return its file. SaveError."""
    # Imported late: it is needed once, at the end.
    from ja_caregiver.core.report import write_report as write

    return write(meeting, folder)


class MeetingFolder:
    """Keeps what is to be written; `save` writes it, and may be called from another thread."""

    def __init__(self, folder: Path, write_report: ReportWriter | None = None) -> None:
        """`write_report`: makes the report of a meeting that has ended; None: no report."""
        self.folder = folder
        self.report = ''
        """The path of the report, once it is written."""
        self._write_report = write_report
        self._lock = threading.Lock()
        self._meeting: Meeting | None = None
        self._waiting: dict[str, NDArray[np.uint8]] = {}

    def add_picture(self, name: str, pixels: NDArray[np.uint8]) -> str:
        """Queue a picture (H, W, 3) RGB; return its file name beside the meeting's file."""
        path = f'{PICTURES}/{name}.jpg'
        with self._lock:
            self._waiting[path] = _small(pixels)
            while len(self._waiting) > _MOST_WAITING:
                del self._waiting[next(iter(self._waiting))]
        return path

    def set_meeting(self, meeting: Meeting) -> None:
        """Queue the meeting as it is now."""
        with self._lock:
            self._meeting = meeting

    def leave_out_report(self) -> None:
        """Write no report any more: the process ends, and another one makes it."""
        self._write_report = None

    def save(self) -> None:
        """Write what is queued, the meeting first; then, if it has ended, the report.

        Raises SaveError; what was not written stays queued.
        """
        with self._lock:
            meeting, waiting = self._meeting, dict(self._waiting)
        if meeting is not None:
            save_meeting(meeting, self.folder)
        for path, pixels in waiting.items():
            write_file(self.folder / path, _jpeg(pixels))
            with self._lock:
                self._waiting.pop(path, None)
        write_report = self._write_report
        if meeting is not None and meeting.ended and write_report and not self.report:
            self.report = str(write_report(meeting, self.folder))


def crop_around(
    picture: NDArray[np.uint8], centre: tuple[float, float], size: tuple[float, float]
) -> NDArray[np.uint8]:
    """Return the part of a picture (H, W, 3) around (u, v) with a width and a height [px].

    Cut off at the border; the whole picture where nothing would be left.
    """
    height, width = picture.shape[:2]
    left, right = (_bounded(centre[0] + side * size[0] / 2, width) for side in (-1, 1))
    top, bottom = (_bounded(centre[1] + side * size[1] / 2, height) for side in (-1, 1))
    cropped = picture[top:bottom, left:right]
    return cropped if cropped.size else picture


def _bounded(pixel: float, size: int) -> int:
    return int(np.clip(np.nan_to_num(pixel), 0, size))


def _small(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a copy of a picture that is not wider than needed."""
    width = pixels.shape[1]
    if width <= _WIDEST_PX:
        return pixels.copy()
    scale = _WIDEST_PX / width
    smaller = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return smaller.astype(np.uint8)


def _jpeg(pixels: NDArray[np.uint8]) -> bytes:
    bgr = cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR)
    done, data = cv2.imencode('.jpg', bgr, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    if not done:
        raise ValueError(f'a picture of shape {pixels.shape} cannot be written as JPEG')
    return data.tobytes()
