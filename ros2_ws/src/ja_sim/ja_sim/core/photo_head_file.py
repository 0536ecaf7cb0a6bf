"""A head made from a photograph, as a file: a mesh, its texture, and where the eyes are.

`ja_caregiver` makes such files; a scene names one in ``caregiver.photo``. The file is a NumPy
archive (.npz) with the fields of `PhotoHead` and a version of the format.
"""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_common.core.files import write_file
from ja_common.core.safe_files import read_bytes

FORMAT = 1
_LARGEST_BYTES = 2**26
_MOST_VERTICES, _MOST_FACES, _LARGEST_SIDE = 60_000, 120_000, 4096
_FARTHEST_M = 1.0
# Name -> type, shape; None: any length.
_ARRAYS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    'vertices': ('float32', (None, 3)),
    'faces': ('int32', (None, 3)),
    'uv': ('float32', (None, 2)),
    'texture': ('uint8', (None, None, 3)),
    'eyes': ('float64', (2, 3)),
    'face': ('float64', (3,)),
    'skin': ('float64', (3,)),
    'shirt': ('float64', (3,)),
}


@dataclass(frozen=True, eq=False)
class PhotoHead:
    """A head in the rest frame of the caregiver: x to the robot, y to her left, z up [m].

    `vertices` (V, 3) float32 and `faces` (F, 3) int32, counter-clockwise from outside; `uv`
    (V, 2) in 0..1, from the left and the upper edge of `texture` (H, W, 3) uint8 RGB. `eyes`
    (2, 3): centres of the left and the right eyeball; `face` (3,): the centre of the face. The
    colours `skin` and `shirt`, (3,), are RGB in 0..1. The photographed eyes are part of the
    texture: only the head turns.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    uv: NDArray[np.float32]
    texture: NDArray[np.uint8]
    eyes: NDArray[np.float64]
    face: NDArray[np.float64]
    skin: NDArray[np.float64]
    shirt: NDArray[np.float64]


def write_photo_head(path: Path, head: PhotoHead) -> Path:
    """Write a head into a file (.npz), whole or not at all; return its path. Raises SaveError."""
    content = io.BytesIO()
    np.savez_compressed(content, format=FORMAT, **vars(head))
    write_file(path, content.getvalue())
    return path


def read_photo_head(path: Path) -> PhotoHead:
    """Read a head. Raises ConfigError, of one sentence, if the file holds none."""
    data = read_bytes(path, _LARGEST_BYTES)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            unpacked = sum(each.file_size for each in archive.infolist())
        if unpacked > _LARGEST_BYTES:
            raise _DamagedError(f'it unpacks to {unpacked} bytes')
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            version = arrays['format']
            if version.shape or version != FORMAT:
                raise _DamagedError(f'its format is not {FORMAT}')
            found = {name: _checked(name, arrays[name]) for name in _ARRAYS}
    except (KeyError, ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise ConfigError(
            f'{path} holds no head of a photograph ({_reason(error)}): make it again from the '
            'photograph'
        ) from None
    return _head(path, found)


class _DamagedError(ValueError):
    """An archive that holds no head; the message says why."""


def _reason(error: Exception) -> str:
    if isinstance(error, KeyError):
        return 'it lacks an array'
    return (
        str(error).partition('\n')[0][:120] if isinstance(error, _DamagedError) else 'no archive'
    )


def _checked(name: str, array: np.ndarray) -> np.ndarray:
    kind, shape = _ARRAYS[name]
    fits = array.ndim == len(shape) and all(
        want in (None, have) for want, have in zip(shape, array.shape, strict=True)
    )
    if not fits or array.dtype != kind:
        raise _DamagedError(f'{name} is {array.dtype} {array.shape}')
    if not np.isfinite(array).all():
        raise _DamagedError(f'{name} is not finite')
    return array


def _head(path: Path, found: dict[str, np.ndarray]) -> PhotoHead:
    vertices, faces = found['vertices'], found['faces']
    height, width = found['texture'].shape[:2]
    colours = np.concatenate([found['skin'], found['shirt']])
    problems = {
        'vertices': not 4 <= len(vertices) <= _MOST_VERTICES
        or np.abs(vertices).max() > _FARTHEST_M,
        'faces': not 4 <= len(faces) <= _MOST_FACES
        or faces.min() < 0
        or faces.max() >= len(vertices),
        'uv': len(found['uv']) != len(vertices) or found['uv'].min() < 0 or found['uv'].max() > 1,
        'texture': not 16 <= min(height, width) <= max(height, width) <= _LARGEST_SIDE,
        'eyes': np.abs(found['eyes']).max() > _FARTHEST_M,
        'face': np.abs(found['face']).max() > _FARTHEST_M,
        'colours': colours.min() < 0 or colours.max() > 1,
    }
    wrong = [name for name, bad in problems.items() if bad]
    if wrong:
        raise ConfigError(
            f'{path} holds no usable head ({", ".join(wrong)} out of range): make it again from '
            'the photograph'
        )
    return PhotoHead(**found)
