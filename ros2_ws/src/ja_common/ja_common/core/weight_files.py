"""Files of learned weights: the one place that opens them, and notes which they really were.

What a learner starts from decides with what it may be compared (`ja_learning.core.track`). So a
file of weights is named by the SHA-256 of the bytes that were loaded, whatever its name promises.
"""

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

_SHOWN_DIGITS = 16


class WeightFile(Protocol):
    """A `Path`, or a resource of a package (`importlib.resources.files`)."""

    @property
    def name(self) -> str: ...
    def read_bytes(self) -> bytes: ...


_open_notes: list[dict[str, str]] = []


def read_weights(file: WeightFile) -> bytes:
    """Return the bytes of a weight file, noted by every `note_weight_files` that is open.

    Raises OSError when it cannot be read.
    """
    content = file.read_bytes()
    digest = hashlib.sha256(content).hexdigest()
    for notes in _open_notes:
        notes[file.name] = digest
    return content


def note_weights_at(path: Path) -> Path:
    """Note a weight file as `read_weights` does, for a library that opens it itself; return it."""
    read_weights(path)
    return path


@contextmanager
def note_weight_files() -> Iterator[dict[str, str]]:
    """Yield a dictionary, name -> SHA-256 in hexadecimal, of the weight files read meanwhile."""
    notes: dict[str, str] = {}
    _open_notes.append(notes)
    try:
        yield notes
    finally:
        # By identity: the notes of two nodes may be equal.
        _open_notes[:] = [each for each in _open_notes if each is not notes]


def weight_files_text(files: Mapping[str, str]) -> str:
    """Return names and the first digits of their SHA-256 as one word each, for tables."""
    return ' '.join(f'{name}={files[name][:_SHOWN_DIGITS]}' for name in sorted(files))


def changed_weight_files(before: Mapping[str, str], now: Mapping[str, str]) -> str:
    """Return in one clause which weight files differ; '' if none does."""
    parts = []
    for name in sorted(before.keys() | now.keys()):
        if before.get(name) != now.get(name):
            was, is_now = (each.get(name, 'none')[:_SHOWN_DIGITS] for each in (before, now))
            parts.append(f'{name} was {was} and is {is_now}')
    return ', '.join(parts)
