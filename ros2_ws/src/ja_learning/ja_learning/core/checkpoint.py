"""One checkpoint: named arrays and a description in an .npz file, written all or not at all."""

import json
import os
import zipfile
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

FORMAT = 'joint-attention-checkpoint-2'

LARGEST_BYTES = 2**30
"""No larger state is written, and no file that would fill more memory is read."""


def save_checkpoint(
    path: Path, arrays: dict[str, NDArray[Any]], description: dict[str, Any]
) -> None:
    """Write a checkpoint so that at any instant `path` is either the old file or the new one.

    The format and the versions of what wrote it are added to the description. Raises OSError when
    the folder cannot be written, ValueError when the arrays are larger than `LARGEST_BYTES`.
    """
    size = sum(array.nbytes for array in arrays.values())
    if size > LARGEST_BYTES:
        raise ValueError(
            f'{path}: {size} bytes are more than the {LARGEST_BYTES} of a checkpoint: '
            'let the learner remember fewer trials'
        )
    text = json.dumps({'format': FORMAT, 'versions': _versions(), **description})
    contents: dict[str, Any] = {**arrays, 'description': np.array(text)}
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f'.{path.name}.{os.getpid()}')
    try:
        with open(temporary, 'wb') as file:
            np.savez(file, **contents)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def load_checkpoint(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Return arrays and description of a checkpoint; no code from the file is run (no pickle).

    Raises FileNotFoundError, or ValueError when the file is damaged or not a checkpoint.
    """
    if not path.exists():
        raise FileNotFoundError(f'no checkpoint at {path}')
    if not zipfile.is_zipfile(path):
        raise ValueError(f'{path} is not a checkpoint, or was cut short: it is no .npz file')
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
        if size > LARGEST_BYTES:
            raise ValueError(f'its {size} bytes are more than {LARGEST_BYTES}')
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        description = json.loads(str(arrays.pop('description')))
        found = description['format']
    except Exception as error:
        # A damaged file shows in a dozen kinds of error from zipfile, numpy and json.
        raise ValueError(f'{path} is not a readable checkpoint: {error}') from None
    if found != FORMAT:
        raise ValueError(f'{path} has format {found!r}, not {FORMAT!r}')
    return arrays, description


@cache
def _versions() -> dict[str, str]:
    return {name: version(name) for name in ('ja_learning', 'torch', 'numpy')}
