"""Opens a source of pictures by what its name means."""

from pathlib import Path
from urllib.parse import urlsplit

import cv2

from ja_perception.core.film import Film
from ja_perception.core.frame_sources import FrameSource, SourceError, SourceOptions, Warn
from ja_perception.core.live_sources import Device, Stream, capture_url, shown_url
from ja_perception.core.picture_folder import PictureFolder, list_pictures
from ja_perception.core.pictures import PICTURE_SUFFIXES, Pictures

_SCHEMES = ('rtsp', 'rtsps', 'rtmp', 'http', 'https', 'udp', 'tcp', 'rtp', 'srt')


def open_source(source: str, options: SourceOptions, warn: Warn) -> FrameSource:
    """Open a device number or path, an address, a film, a folder of pictures, or one picture.

    With ``loop`` films and folders restart at their end; a single picture never ends. ``warn``
    receives what is left out or cannot be decoded.
    Raises ``SourceError`` when it cannot be opened or holds no picture.
    """
    if source.isdigit() or source.startswith('/dev/'):
        return Device(source, options)
    if '://' in source:
        return _open_address(source, options, warn)
    path = Path(source).expanduser()
    if not path.exists():
        raise SourceError(f"no such file, folder or device: '{source}'")
    if path.is_dir():
        return PictureFolder(list_pictures(path), options, warn)
    if not path.is_file():
        raise SourceError(
            f"'{source}' is no regular file, folder or camera: give a file, a folder, a device "
            'number or an address (rtsp://...)'
        )
    if path.name.startswith('._'):
        raise SourceError(
            f"'{source}' is what macOS stores about '{path.name[2:]}', not the picture itself"
        )
    if path.suffix.lower() in PICTURE_SUFFIXES or cv2.haveImageReader(str(path)):
        return Pictures(path, options, warn)
    return Film(str(path), options, warn)


def _open_address(source: str, options: SourceOptions, warn: Warn) -> FrameSource:
    scheme = urlsplit(source).scheme.lower()
    if scheme == 'file':
        return open_source(urlsplit(source).path, options, warn)
    if scheme not in _SCHEMES:
        raise SourceError(
            f"'{shown_url(source)}' cannot be a source: an address begins with one of "
            f'{", ".join(name + "://" for name in _SCHEMES)}'
        )
    capture = capture_url(source)
    if capture.get(cv2.CAP_PROP_FRAME_COUNT) > 1:  # with an end: it waits for us, live does not
        return Film(source, options, warn, capture)
    return Stream(source, options, capture)
