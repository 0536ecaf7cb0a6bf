"""Pictures from a webcam, a video file, an image folder or a single image."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_common.core.picture_size import MOST_PIXELS, picture_size
from ja_common.core.safe_files import read_bytes

_LARGEST_PICTURE_BYTES = 2**28
_PICTURE_SUFFIXES = {'.png', '.jpg', '.jpeg', '.bmp', '.tif', '.tiff', '.webp', '.ppm', '.pgm'}


class SourceError(ValueError):
    """A source without pictures; the text names it, the reason and what to do."""


class FrameSource(Protocol):
    """An endless or ending stream of (H, W, 3) uint8 RGB pictures."""

    rate_hz: float | None
    """The source's own rate; None when it has none."""

    def next_frame(self) -> NDArray[np.uint8] | None:
        """Return the next picture; None at the end.

        Raises ``SourceError`` when the device is gone.
        """
        ...

    def close(self) -> None:
        """Release the device or file."""
        ...


def open_source(source: str, loop: bool, still_frames: int) -> FrameSource:
    """Open ``source``: a device number or path, a video file, a folder of images, or one image.

    With ``loop`` files and folders restart at their end. Each picture of a folder is returned
    ``still_frames`` times; a single image is returned for ever.
    Raises ``SourceError`` when it cannot be opened or holds no picture.
    """
    if source.isdigit() or source.startswith('/dev/'):
        return Device(source)
    path = Path(source).expanduser()
    if not path.exists():
        raise SourceError(f"no such file, folder or device: '{source}'")
    if path.is_dir():
        pictures = sorted(p for p in path.iterdir() if p.suffix.lower() in _PICTURE_SUFFIXES)
        if not pictures:
            raise SourceError(f"no pictures in the folder '{source}'")
        return Pictures(pictures, loop, still_frames)
    if path.suffix.lower() in _PICTURE_SUFFIXES:
        return Pictures([path], loop=True, still_frames=still_frames)
    return Video(path, loop)


class Device:
    """A webcam, by number ('0') or path ('/dev/video0')."""

    def __init__(self, source: str) -> None:
        self._source = source
        if source.startswith('/dev/') and not Path(source).exists():
            raise SourceError(f"no such device: '{source}'")
        self._capture = cv2.VideoCapture(int(source) if source.isdigit() else source)
        if not self._capture.isOpened():
            raise SourceError(
                f"camera '{source}' cannot be opened: is it connected, allowed to you, and not in "
                'use by another program?'
            )
        self.rate_hz: float | None = self._capture.get(cv2.CAP_PROP_FPS) or None

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


class Video:
    """A video file."""

    def __init__(self, path: Path, loop: bool) -> None:
        self._path, self._loop = path, loop
        self._capture = cv2.VideoCapture(str(path))
        self._given = 0
        if not self._capture.isOpened() or not self._capture.grab():
            raise SourceError(f"'{path}' cannot be read as a video or picture")
        self.rate_hz: float | None = self._capture.get(cv2.CAP_PROP_FPS) or None
        self._rewind()

    def next_frame(self) -> NDArray[np.uint8] | None:
        """See ``FrameSource``."""
        got, bgr = self._capture.read()
        if not got and self._loop:
            self._rewind()
            got, bgr = self._capture.read()
        return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB) if got else None

    def close(self) -> None:
        """See ``FrameSource``."""
        self._capture.release()

    def _rewind(self) -> None:
        # Opening the file again is exact for every container; seeking is not.
        self._capture.release()
        self._capture = cv2.VideoCapture(str(self._path))


def _read_picture(path: Path) -> NDArray[np.uint8]:
    try:
        data = read_bytes(path, _LARGEST_PICTURE_BYTES)
    except ConfigError as error:
        raise SourceError(str(error)) from None
    width, height = picture_size(data) or (0, 0)
    if width * height > MOST_PIXELS:
        raise SourceError(f"'{path}' is larger than {MOST_PIXELS} pixels")
    picture = None
    with suppress(cv2.error):  # a picture of another format that is too large for OpenCV
        picture = cv2.imread(str(path), cv2.IMREAD_COLOR_RGB)
    if picture is None:
        raise SourceError(f"'{path}' cannot be read as a picture")
    return picture.astype(np.uint8, copy=False)


class Pictures:
    """Still pictures, one after the other."""

    rate_hz: float | None = None

    def __init__(self, paths: list[Path], loop: bool, still_frames: int) -> None:
        # Report an unreadable file at the start, not in the middle of a run.
        for path in paths:
            if not cv2.haveImageReader(str(path)):
                raise SourceError(f"'{path}' cannot be read as a picture")
        self._paths, self._loop, self._still_frames = paths, loop, still_frames
        self._frames = self._stream()

    def next_frame(self) -> NDArray[np.uint8] | None:
        """See ``FrameSource``."""
        return next(self._frames, None)

    def close(self) -> None:
        """See ``FrameSource``."""

    def _stream(self) -> Iterator[NDArray[np.uint8]]:
        while True:
            for path in self._paths:
                picture = _read_picture(path)
                for _ in range(self._still_frames):
                    yield picture
            if not self._loop:
                return
