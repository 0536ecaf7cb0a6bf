"""Progress bars of long computations; without a terminal, one line per tenth."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as RichProgress


class ProgressBars:
    """Bars, one below the other; `advance(n)` may be called from any thread."""

    def __init__(self, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)

    def print_line(self, line: str) -> None:
        """Print one line above the bars."""
        self._console.print(line)

    @contextmanager
    def bar(self, label: str, total: int) -> Iterator[Callable[[int], None]]:
        """Show a bar while the block runs; yield the function that advances it towards `total`."""
        if not self._console.is_terminal:
            yield self._tenths(label, total)
            return
        columns = (
            TextColumn('{task.description}'),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(elapsed_when_finished=True),
        )
        with RichProgress(*columns, console=self._console) as bars:
            task = bars.add_task(label, total=total)
            yield lambda done: bars.advance(task, done)

    def _tenths(self, label: str, total: int) -> Callable[[int], None]:
        done, printed = 0, 0

        def advance(more: int) -> None:
            nonlocal done, printed
            done += more
            if 10 * done // total > printed:
                printed = 10 * done // total
                self.print_line(f'{label}: {done} of {total}')

        return advance
