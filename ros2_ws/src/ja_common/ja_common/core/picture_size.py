"""The size that a picture in JPEG or PNG claims, and whether it is complete.

A decoder asks for the memory of all the pixels first, and a picture of some kB may claim 4 * 10^9.
"""

import struct

MOST_PIXELS = 2**26
"""No larger picture is decoded: 67 million pixels, more than any camera of a head has."""

_PNG = b'\x89PNG\r\n\x1a\n'
_JPEG = b'\xff\xd8'
# Markers that hold the size (start of frame), and those without a length.
_START_OF_FRAME = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}
_WITHOUT_LENGTH = {0x01, *range(0xD0, 0xD9)}
_END_OF_IMAGE = 0xD9


def picture_size(data: bytes | memoryview) -> tuple[int, int] | None:
    """Return width and height [px] of a JPEG or PNG; None where it names none, or is neither."""
    content = memoryview(data).cast('B')
    try:
        if bytes(content[:8]) == _PNG:
            return struct.unpack_from('>II', content, 16)
        if bytes(content[:2]) == _JPEG:
            return _jpeg_size(content)
    except struct.error:
        pass
    return None


def _jpeg_size(content: memoryview) -> tuple[int, int] | None:
    offset = 2
    while True:
        marker, kind = struct.unpack_from('BB', content, offset)
        if marker != 0xFF:
            return None
        if kind == 0xFF:  # a byte that fills
            offset += 1
        elif kind in _WITHOUT_LENGTH:
            offset += 2
        elif kind in _START_OF_FRAME:
            height, width = struct.unpack_from('>HH', content, offset + 5)
            return width, height
        else:
            (length,) = struct.unpack_from('>H', content, offset + 2)
            offset += 2 + length


def is_cut_off(data: bytes | memoryview) -> bool:
    """Return whether a JPEG or PNG ends before its end marker.

    A decoder shows the rest of such a JPEG in grey, and reports no error.
    """
    content = bytes(data)
    if content[:8] == _PNG:
        return _png_is_cut_off(content)
    return content[:2] == _JPEG and _jpeg_is_cut_off(content)


def _png_is_cut_off(content: bytes) -> bool:
    offset = 8
    while offset + 12 <= len(content):
        (length,) = struct.unpack_from('>I', content, offset)
        if content[offset + 4 : offset + 8] == b'IEND':
            return False
        offset += 12 + length
    return True


def _jpeg_is_cut_off(content: bytes) -> bool:
    offset = 2
    while True:
        # Inside of a scan, 0xFF is followed by 0 or by a restart marker.
        offset = content.find(b'\xff', offset)
        if not 0 <= offset < len(content) - 1:
            return True
        kind = content[offset + 1]
        if kind == _END_OF_IMAGE:
            return False
        if kind in (0x00, 0xFF) or kind in _WITHOUT_LENGTH:
            offset += 1 if kind == 0xFF else 2
        elif offset + 4 > len(content):
            return True
        else:
            (length,) = struct.unpack_from('>H', content, offset + 2)
            offset += 2 + length
