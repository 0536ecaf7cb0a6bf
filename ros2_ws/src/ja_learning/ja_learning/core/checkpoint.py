"""One checkpoint: named arrays and a description in an .npz file, written all or not at all."""

import json
import math
import re
import zipfile
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ja_common.core.files import atomic_file

FORMAT = 'joint-attention-checkpoint-2'

LARGEST_BYTES = 2**30
"""No larger state is written, and no file that would fill more memory is read."""

_MOST_ARRAYS = 1000
_LONGEST_DESCRIPTION = 2**16
_MEMBER = re.compile(r'(?P<array>[A-Za-z]\w*(\.\w+)*)\.npy', re.ASCII)
_READ_HEADER = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


def save_checkpoint(
    path: Path, arrays: dict[str, NDArray[Any]], description: dict[str, Any]
) -> None:
    """Write a checkpoint so that at any instant `path` is either the old file or the new one.

    The format and the versions of what wrote it are added to the description. Raises SaveError,
    and ValueError when the arrays are larger than `LARGEST_BYTES`.
    """
    size = sum(array.nbytes for array in arrays.values())
    if size > LARGEST_BYTES:
        raise ValueError(
            f'{path}: {size} bytes are more than the {LARGEST_BYTES} of a checkpoint: '
            'let the learner remember fewer trials'
        )
    text = json.dumps({'format': FORMAT, 'versions': _versions(), **description})
    contents: dict[str, Any] = {**arrays, 'description': np.array(text)}
    with atomic_file(path) as file:
        np.savez(file, **contents)


def load_checkpoint(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Return arrays and description of a checkpoint; no code from the file is run (no pickle).

    Raises FileNotFoundError, or ValueError when the file is damaged or not a checkpoint.
    """
    if not path.exists():
        raise FileNotFoundError(f'no checkpoint at {path}')
    if not path.is_file() or not zipfile.is_zipfile(path):
        raise ValueError(f'{path} is not a checkpoint, or was cut short: it is no .npz file')
    try:
        with zipfile.ZipFile(path) as archive:
            arrays = _read_arrays(archive)
        text = str(arrays.pop('description'))
        if len(text) > _LONGEST_DESCRIPTION:
            raise ValueError(f'its description has {len(text)} characters')
        description = json.loads(text)
        found = description['format']
    except Exception as error:
        # A damaged file shows in a dozen kinds of error from zipfile, numpy and json.
        why = f'{error}'.partition('\n')[0][:200] or type(error).__name__
        raise ValueError(f'{path} is not a readable checkpoint: {why}') from None
    if found != FORMAT:
        raise ValueError(f'{path} has format {str(found)[:100]!r}, not {FORMAT!r}')
    return arrays, description


def _read_arrays(archive: zipfile.ZipFile) -> dict[str, NDArray[Any]]:
    """Return the arrays of an archive, whose sizes are checked before anything is unpacked."""
    entries = archive.infolist()
    if len(entries) > _MOST_ARRAYS:
        raise ValueError(f'it holds more than {_MOST_ARRAYS} arrays')
    size = sum(entry.file_size for entry in entries)
    if size > LARGEST_BYTES:
        raise ValueError(f'its {size} bytes are more than {LARGEST_BYTES}')
    arrays: dict[str, NDArray[Any]] = {}
    for entry in entries:
        name = _MEMBER.fullmatch(entry.filename)
        if name is None or name['array'] in arrays:
            raise ValueError(f'{entry.filename[:100]!r} in it is no array, or there twice')
        with archive.open(entry) as file:
            arrays[name['array']] = _read_array(file, name['array'])
    return arrays


def _read_array(file: IO[bytes], name: str) -> NDArray[Any]:
    version = npy.read_magic(file)
    if version not in _READ_HEADER:
        raise ValueError(f'{name} is of version {version} of .npy')
    shape, fortran, dtype = _READ_HEADER[version](file)
    if dtype.kind not in 'biufU':  # above all no objects, which would be unpickled
        raise ValueError(f'{name} holds neither numbers nor text but {dtype}')
    content = file.read()
    if len(content) != math.prod(shape) * dtype.itemsize:
        raise ValueError(f'{name} is not as long as its shape {shape} says')
    array = np.frombuffer(content, dtype).reshape(shape, order='F' if fortran else 'C')
    return array.copy()


@cache
def _versions() -> dict[str, str]:
    return {name: version(name) for name in ('ja_learning', 'torch', 'numpy')}
