"""Progress bars on a terminal, lines elsewhere."""

import io

from rich.console import Console

from ja_experiments.progress_bars import ProgressBars


def shown(terminal: bool, steps: list[int], total: int) -> list[str]:
    written = io.StringIO()
    progress = ProgressBars(Console(file=written, force_terminal=terminal, width=80))
    with progress.bar('learning', total) as advance:
        for step in steps:
            advance(step)
    return written.getvalue().splitlines()


def test_without_a_terminal_every_tenth_is_a_line():
    assert shown(False, [1] * 25, 25)[::3] == [
        'learning: 3 of 25',
        'learning: 10 of 25',
        'learning: 18 of 25',
        'learning: 25 of 25',
    ]
    assert shown(False, [3, 4], 7) == ['learning: 3 of 7', 'learning: 7 of 7']
    assert shown(False, [], 7) == []


def test_on_a_terminal_there_is_a_bar():
    assert any('25/25' in line for line in shown(True, [5] * 5, 25))
