"""Picture files and films as people have them, for tests."""

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np


def flat(colour, size=(64, 48)):
    """Return a picture (H, W, 3) RGB of one colour."""
    return np.full((size[1], size[0], 3), colour, np.uint8)


def write_picture(path, picture):
    """Write an RGB picture; return its path as text."""
    path.parent.mkdir(exist_ok=True)
    assert cv2.imwrite(str(path), picture[..., ::-1])
    return str(path)


def write_film(path, pictures, rate_hz, codec='MJPG'):
    """Write RGB pictures as a film; return its path as text."""
    height, width = pictures[0].shape[:2]
    code = cv2.VideoWriter_fourcc(*codec)
    writer = cv2.VideoWriter(str(path), code, rate_hz, (width, height))
    assert writer.isOpened()
    for picture in pictures:
        writer.write(np.ascontiguousarray(picture[..., ::-1]))
    writer.release()
    return str(path)


def cut(path, share=0.5):
    """Cut a file, as a download that was broken off."""
    content = Path(path).read_bytes()
    Path(path).write_bytes(content[: int(share * len(content))])


def jpeg_with_orientation(picture, orientation):
    """Return an RGB picture as JPEG with an orientation in EXIF."""
    jpeg = cv2.imencode('.jpg', picture[..., ::-1])[1].tobytes()
    entry = struct.pack('<HHIHH', 0x112, 3, 1, orientation, 0)
    exif = b'Exif\0\0II*\0' + struct.pack('<IH', 8, 1) + entry + bytes(4)
    return jpeg[:2] + b'\xff\xe1' + struct.pack('>H', len(exif) + 2) + exif + jpeg[2:]


def tiff(samples, orientation=1):
    """Return (H, W) or (H, W, 3) samples of any type as an uncompressed TIFF."""
    height, width = samples.shape[:2]
    count = samples.shape[2] if samples.ndim == 3 else 1
    bits, kind = 8 * samples.dtype.itemsize, 3 if samples.dtype.kind == 'f' else 1
    data = samples.tobytes()
    tags = [(256, width), (257, height), (258, bits), (259, 1), (262, 2 if count == 3 else 1),
            (273, 8), (274, orientation), (277, count), (278, height), (279, len(data)),
            (339, kind)]  # fmt: skip
    entries = b''.join(struct.pack('<HHII', tag, 4, 1, value) for tag, value in tags)
    if count == 3:  # three numbers of bits do not fit into the entry
        place = 8 + len(data) + 2 + 12 * len(tags) + 4
        wide = struct.pack('<HHII', 258, 3, 3, place)
        entries = entries.replace(struct.pack('<HHII', 258, 4, 1, bits), wide)
    end = struct.pack('<I', 0) + struct.pack('<3H', bits, bits, bits)
    return (
        struct.pack('<2sHI', b'II', 42, 8 + len(data))
        + data
        + (struct.pack('<H', len(tags)) + entries + end)
    )


def palette_png(indices, colours):
    """Return (H, W) indices of RGB colours as a PNG with a palette."""
    height, width = indices.shape
    rows = b''.join(b'\0' + row.tobytes() for row in indices.astype(np.uint8))

    def chunk(kind, data):
        check = struct.pack('>I', zlib.crc32(kind + data))
        return struct.pack('>I', len(data)) + kind + data + check

    return b'\x89PNG\r\n\x1a\n' + b''.join([
        chunk(b'IHDR', struct.pack('>IIBBBBB', width, height, 8, 3, 0, 0, 0)),
        chunk(b'PLTE', np.uint8(colours).tobytes()),
        chunk(b'IDAT', zlib.compress(rows)),
        chunk(b'IEND', b''),
    ])  # fmt: skip
