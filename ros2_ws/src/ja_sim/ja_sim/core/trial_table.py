"""A CSV file with one row for each trial, which grows while the disk allows it."""

import csv
import io
import os
from collections import deque
from collections.abc import Iterable
from itertools import islice
from pathlib import Path
from typing import Any

from ja_common.core.files import SaveError, why_not_written, write_file
from ja_sim.core.score import TrialOutcome

_COLUMNS = (
    'trial', 'stamp_ns', 'objects', 'in_view', 'success', 'attended_pan_rad', 'attended_tilt_rad',
    'fixated_pan_rad', 'fixated_tilt_rad',
)  # fmt: skip


class TrialTable:
    """Rows wait in memory until `save` has written them: a full disk loses none.

    One thread may append while another saves.
    """

    def __init__(self, path: Path) -> None:
        """Begin the file anew. Raises SaveError."""
        self._path = path
        self._pending: deque[TrialOutcome] = deque()
        write_file(path, _csv([_COLUMNS]))

    def append_trial(self, outcome: TrialOutcome) -> None:
        """Keep a finished trial for the next `save`."""
        self._pending.append(outcome)

    def save(self) -> None:
        """Append all rows that wait, whole or not at all. Raises SaveError."""
        count = len(self._pending)
        rows = [_row(outcome) for outcome in islice(self._pending, count)]
        try:
            self._append(rows)
        except OSError as error:
            raise SaveError(why_not_written(self._path, error)) from error
        for _ in range(count):
            self._pending.popleft()

    def _append(self, rows: list[list[Any]]) -> None:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with open(self._path, 'ab', buffering=0) as file:
            size = os.fstat(file.fileno()).st_size
            # A file that was removed meanwhile begins with its header again.
            text = _csv(rows if size else [_COLUMNS, *rows])
            try:
                while text:
                    text = text[file.write(text) :]
            except OSError:
                if file.seekable():
                    file.truncate(size)
                raise


def _csv(rows: Iterable[Iterable[Any]]) -> bytes:
    text = io.StringIO(newline='')
    csv.writer(text).writerows(rows)
    return text.getvalue().encode()


def _row(outcome: TrialOutcome) -> list[Any]:
    numbers = [outcome.trial, outcome.stamp_ns, outcome.objects]
    flags = [int(outcome.in_view), int(outcome.success)]
    fixated = outcome.fixated or ('', '')  # given up
    return [*numbers, *flags, *outcome.attended, *fixated]
