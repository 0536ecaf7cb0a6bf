"""Checkpoints: named arrays and a description in one .npz file, written all or not at all."""

import json
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

FORMAT = 'joint-attention-checkpoint-1'


def save_checkpoint(
    path: Path, arrays: dict[str, NDArray[Any]], description: dict[str, Any]
) -> None:
    """Write a checkpoint so that at any instant `path` is either the old file or the new one.

    Raises OSError when the folder cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({'format': FORMAT, **description})
    contents: dict[str, Any] = {**arrays, 'description': np.array(text)}
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
    """Arrays and description of a checkpoint; loading runs no code from the file (no pickle).

    Raises FileNotFoundError, or ValueError when the file is damaged or not a checkpoint.
    """
    if not path.exists():
        raise FileNotFoundError(f'no checkpoint at {path}')
    if not zipfile.is_zipfile(path):
        raise ValueError(f'{path} is not a checkpoint, or was cut short: it is no .npz file')
    try:
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
