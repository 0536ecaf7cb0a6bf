"""Picture files: a single one as a source, and how one is decoded."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_common.core.picture_size import MOST_PIXELS, is_cut_off, picture_size
from ja_common.core.safe_files import read_bytes
from ja_common.core.sample_depth import SampleDepth
from ja_perception.core.frame_sources import STILL_HZ, SourceError, SourceOptions, Warn

PICTURE_SUFFIXES = {
    '.png', '.jpg', '.jpeg', '.bmp', '.tif', '.tiff', '.webp', '.ppm', '.pgm', '.gif',
}  # fmt: skip
_LARGEST_BYTES = 2**28
_MOST_ANIMATED_PIXELS = 2**27
_COLOUR = cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH
_TIFF = (b'II*\0', b'MM\0*')
# Browsers show pictures of shorter or no duration for this time.
_LEAST_DURATION_MS, _USUAL_DURATION_MS = 20, 100


@dataclass(frozen=True)
class Shown:
    """A picture (H, W, 3) uint8 RGB, and for how long it is shown [s]; None: a still picture."""

    pixels: NDArray[np.uint8]
    duration_s: float | None = None


def read_picture(path: Path, depth: SampleDepth, warn: Warn) -> list[Shown]:
    """Return the picture of a file, or those of an animation, upright (EXIF) in RGB.

    Raises ``SourceError`` that names the file and the reason.
    """
    try:
        content = read_bytes(path, _LARGEST_BYTES)
    except ConfigError as error:
        raise SourceError(str(error)) from None
    width, height = picture_size(content) or (0, 0)
    if width * height > MOST_PIXELS:
        raise SourceError(f"'{path}' is larger than {MOST_PIXELS} pixels")
    if is_cut_off(content):
        raise SourceError(f"'{path}' ends early, after {len(content)} bytes: is it complete?")
    data = np.frombuffer(content, np.uint8)
    try:
        if _is_animated(content) and hasattr(cv2, 'imdecodeanimation'):
            shown = _decode_animation(path, data, warn)
        else:
            shown = [Shown(_decode_still(path, data, depth))]
            _warn_of_more(path, content, warn)
    except cv2.error:  # more pixels than OpenCV takes, or 32-bit samples
        raise SourceError(f"'{path}' cannot be read as a picture") from None
    return shown


def _decode_still(path: Path, data: NDArray[np.uint8], depth: SampleDepth) -> NDArray[np.uint8]:
    # From memory: OpenCV 4.14 does not read a turned TIFF from a file.
    bgr = cv2.imdecode(data, _COLOUR) if data.size else None
    if bgr is None:
        raise SourceError(f"'{path}' cannot be read as a picture: is it complete?")
    if bgr.dtype == np.uint16:
        bgr = depth.to_8_bits(bgr)
    if bgr.dtype != np.uint8:
        raise SourceError(f"'{path}' holds {bgr.dtype} numbers, no picture of 8 or 16 bits")
    return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)


def _decode_animation(path: Path, data: NDArray[np.uint8], warn: Warn) -> list[Shown]:
    data = data[None]  # OpenCV 4.14 takes a WebP in one row only
    read, first = cv2.imdecodeanimation(data, 0, 1)
    if not read or not len(first.frames):
        raise SourceError(f"'{path}' cannot be read as a picture: is it complete?")
    most = max(1, _MOST_ANIMATED_PIXELS // first.frames[0][..., 0].size)
    _, found = cv2.imdecodeanimation(data, 0, most + 1)
    if len(found.frames) > most:
        warn('animation', f"only the first {most} pictures of '{path}' are shown: it is too large")
    if len(found.frames) == 1:
        return [Shown(_rgb(found.frames[0]))]
    return [
        Shown(_rgb(frame), (ms if ms >= _LEAST_DURATION_MS else _USUAL_DURATION_MS) / 1000)
        for frame, ms in zip(found.frames[:most], found.durations, strict=False)
    ]


def _rgb(frame: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return cv2.cvtColor(frame, cv2.COLOR_BGRA2RGB if frame.shape[2] == 4 else cv2.COLOR_BGR2RGB)


def _is_animated(content: bytes) -> bool:
    """Return whether the content is a GIF, or an animated WebP or PNG."""
    if content[:4] == b'GIF8':
        return True
    if content[:4] == b'RIFF' and content[8:16] == b'WEBPVP8X':
        return len(content) > 20 and bool(content[20] & 2)
    return content[:4] == b'\x89PNG' and b'acTL' in content[:4096]


def _warn_of_more(path: Path, content: bytes, warn: Warn) -> None:
    if _is_animated(content):
        warn('animation', f"only the first picture of '{path}' is shown: OpenCV {cv2.__version__} "
             'reads no animations')  # fmt: skip
    elif content[:4] in _TIFF and (pages := cv2.imcount(str(path))) > 1:
        warn('pages', f"only the first of {pages} pages of '{path}' is shown")


class Player:
    """Repeats each still picture for a while, and shows each of an animation for its time."""

    def __init__(self, options: SourceOptions) -> None:
        self._options = options
        self._still_hz = options.rate_hz or STILL_HZ
        self.period_s = 1 / self._still_hz

    def play(self, shown: list[Shown]) -> Iterator[NDArray[np.uint8]]:
        """Return the pictures one after the other; ``period_s`` is that of the last one."""
        for picture in shown:
            times = 1 if self._options.rate_hz else 0
            if picture.duration_s is None:
                times = max(1, round(self._options.still_s * self._still_hz))
                self.period_s = 1 / self._still_hz
            elif not times:
                # A picture that is shown for long is repeated: silence would be a fault.
                duration_s = max(picture.duration_s, 1 / self._options.highest_rate_hz)
                times = max(1, int(duration_s * STILL_HZ))
                self.period_s = duration_s / times
            for _ in range(times):
                yield picture.pixels


class Pictures:
    """One picture, for ever; or an animation, once or again and again."""

    def __init__(self, path: Path, options: SourceOptions, warn: Warn) -> None:
        self._shown = read_picture(path, SampleDepth(), warn)
        self._player = Player(options)
        self._ends = len(self._shown) > 1 and not options.loop
        self._frames = self._player.play(self._shown)
        count = len(self._shown)
        self.summary = f"'{path}'" + (f', {count} pictures' if count > 1 else '')

    @property
    def period_s(self) -> float:
        """See ``FrameSource``."""
        return self._player.period_s

    def next_frame(self) -> NDArray[np.uint8] | None:
        """See ``FrameSource``."""
        frame = next(self._frames, None)
        if frame is None and not self._ends:
            self._frames = self._player.play(self._shown)
            frame = next(self._frames)
        return frame

    def close(self) -> None:
        """See ``FrameSource``."""
