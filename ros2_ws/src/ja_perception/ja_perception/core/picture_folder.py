"""A folder of pictures, as people have them: with other files among them, some of them damaged."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.sample_depth import SampleDepth
from ja_perception.core.frame_sources import SourceError, SourceOptions, Warn
from ja_perception.core.pictures import PICTURE_SUFFIXES, Player, Shown, read_picture

_FILMS = {'.mp4', '.mov', '.avi', '.mkv', '.webm', '.m4v', '.mpg', '.mpeg', '.ts', '.wmv'}
_OF_SYSTEMS = {'thumbs.db', 'desktop.ini', 'ehthumbs.db'}
_NAMES_SHOWN = 3


@dataclass
class FolderListing:
    """The pictures of a folder in natural order, and what is skipped: reason -> names."""

    folder: Path
    pictures: list[Path] = field(default_factory=list)
    skipped: dict[str, list[str]] = field(default_factory=dict)

    def skip(self, name: str, reason: str) -> None:
        """Count an entry that is no picture."""
        self.skipped.setdefault(reason, []).append(name)


def natural_order(name: str) -> list[tuple[int, int, str]]:
    """Return the key that sorts 2 before 10: numbers by value, letters without case."""
    parts = re.findall(r'(\d+)|(\D+)', name.lower())
    return [(0, int(number), '') if number else (1, 0, text) for number, text in parts]


def list_pictures(folder: Path) -> FolderListing:
    """Return what a folder holds; a file is a picture by its content, not by its name.

    Raises ``SourceError`` when it holds no picture or cannot be read.
    """
    found = FolderListing(folder)
    try:
        entries = sorted(folder.iterdir(), key=lambda path: natural_order(path.name))
    except OSError as error:
        raise SourceError(f"the folder '{folder}' cannot be read: {error.strerror}") from None
    for path in entries:
        suffix = path.suffix.lower()
        if path.name.startswith('.') or path.name.lower() in _OF_SYSTEMS:
            found.skip(path.name, 'hidden or of the system')
        elif path.is_dir():
            found.skip(path.name, 'folder')
        elif not path.is_file():
            found.skip(path.name, 'no regular file')
        elif cv2.haveImageReader(str(path)):
            found.pictures.append(path)
        elif suffix in PICTURE_SUFFIXES:
            found.skip(path.name, 'damaged')
        elif suffix in _FILMS:
            found.skip(path.name, 'film: give it as the source itself')
        else:
            found.skip(path.name, 'of a format that OpenCV does not read as a picture')
    if not found.pictures:
        raise SourceError(f"no pictures in the folder '{folder}'" + _skipped_text(found.skipped))
    return found


class PictureFolder:
    """The pictures of a folder, one after the other."""

    def __init__(self, listing: FolderListing, options: SourceOptions, warn: Warn) -> None:
        self._listing, self._loop, self._warn = listing, options.loop, warn
        self._depth = SampleDepth()
        self._player = Player(options)
        self._sizes: dict[tuple[int, int], str] = {}
        self._damaged: dict[Path, str] = {}
        self._check_some()
        self._frames = self._stream()

    @property
    def period_s(self) -> float:
        """See ``FrameSource``."""
        return self._player.period_s

    @property
    def summary(self) -> str:
        """See ``FrameSource``."""
        skipped = dict(self._listing.skipped)
        if self._damaged:
            names = [path.name for path in self._damaged]
            skipped['damaged'] = skipped.get('damaged', []) + names
        used = len(self._listing.pictures) - len(self._damaged)
        count = used + sum(len(names) for names in skipped.values())
        return f"{used} of {count} files in '{self._listing.folder}' are shown" + _skipped_text(
            skipped
        )

    def next_frame(self) -> NDArray[np.uint8] | None:
        """See ``FrameSource``."""
        try:
            return next(self._frames, None)
        except SourceError:
            self._frames = self._stream()  # an iterator that has raised has ended
            raise

    def close(self) -> None:
        """See ``FrameSource``."""

    def _stream(self) -> Iterator[NDArray[np.uint8]]:
        while True:
            for path in self._listing.pictures:
                if (shown := self._read(path)) is not None:
                    yield from self._player.play(shown)
            if not self._loop:
                return
            if len(self._damaged) == len(self._listing.pictures):
                raise self._none_left()

    def _check_some(self) -> None:
        """Raise SourceError where no picture can be decoded: at the start, not in a run."""
        if all(self._read(path) is None for path in self._listing.pictures):
            raise self._none_left()

    def _read(self, path: Path) -> list[Shown] | None:
        """Return a picture; None where it cannot be decoded (it may be complete next time)."""
        try:
            shown = read_picture(path, self._depth, self._warn)
        except SourceError as error:
            self._damaged[path] = str(error)
            self._warn('damaged pictures', f'{error}; skipped. {self.summary}')
            return None
        self._damaged.pop(path, None)
        self._note_size(shown[0].pixels, path)
        return shown

    def _note_size(self, pixels: NDArray[np.uint8], path: Path) -> None:
        size = (pixels.shape[1], pixels.shape[0])
        if size not in self._sizes and len(self._sizes) == 1:
            (other, first), *_ = self._sizes.items()
            self._warn(
                'sizes of pictures',
                f"the pictures have different sizes ('{first}' {other[0]}x{other[1]}, "
                f"'{path.name}' {size[0]}x{size[1]}): camera_info takes the same horizontal view "
                '(field_of_view_rad) for each',
            )
        self._sizes.setdefault(size, path.name)

    def _none_left(self) -> SourceError:
        reasons = '; '.join(list(self._damaged.values())[:_NAMES_SHOWN])
        return SourceError(
            f"no picture in the folder '{self._listing.folder}' can be decoded: {reasons}"
        )


def _skipped_text(skipped: dict[str, list[str]]) -> str:
    """Return what is left out, counted and with some names; '' where nothing is."""
    if not skipped:
        return ''
    parts = []
    for reason, names in skipped.items():
        shown = ', '.join(f"'{name}'" for name in names[:_NAMES_SHOWN])
        more = ', ...' if len(names) > _NAMES_SHOWN else ''
        parts.append(f'{len(names)} {reason} ({shown}{more})')
    return '; skipped: ' + ', '.join(parts)
