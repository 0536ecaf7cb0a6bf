"""Score many learners in many tasks at once: processes, files and tables."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path

from rich.table import Table

from ja_common.core.config import ConfigError
from ja_common.core.files import write_file
from ja_experiments.learning_tasks.baselines import BASELINES
from ja_experiments.learning_tasks.scoring import CRITERION, ScoreRow, score, score_rows
from ja_experiments.learning_tasks.stage_looks import stage_looks
from ja_experiments.learning_tasks.task_table import find_task
from ja_experiments.processes import run_in_processes

QUICK_BASELINES = tuple(name for name in BASELINES if name != 'ppo')
"""Those that need no further library, and no hundred times more trials."""


def read_seeds(text: str) -> list[int]:
    """Return the seeds of a text like `0-3,7`. Raises ConfigError when it is no such list."""
    seeds: list[int] = []
    try:
        for part in text.split(','):
            first, _, last = part.partition('-')
            seeds += range(int(first), int(last or first) + 1)
    except ValueError:
        seeds = []
    if not seeds or len(set(seeds)) < len(seeds):
        raise ConfigError(f'seeds = {text!r:.50} is no list like 0-3,7 without a seed twice')
    return seeds


def score_all(
    learners: Sequence[str], tasks: Sequence[str], seeds: Sequence[int]
) -> list[ScoreRow]:
    """Return the rows of all learners in all tasks; looks that are not cached are rendered."""
    run_in_processes('caregivers', _render, [(tuple(tasks), seed) for seed in seeds])
    runs = [(name, task, seed) for task in tasks for name in learners for seed in seeds]
    scores = dict(zip(runs, run_in_processes('scores', score, runs), strict=True))
    return [
        row
        for task in tasks
        for name in learners
        for row in score_rows(name, task, [scores[name, task, seed] for seed in seeds])
    ]


def _render(tasks: Sequence[str], seed: int) -> None:
    for task in tasks:
        stage_looks(find_task(task), seed)


def write_scores(rows: Sequence[ScoreRow], seeds: Sequence[int], folder: Path) -> None:
    """Write `scores.json`, `scores.csv` and `scores.md` into a folder. Raises SaveError."""
    table = {'criterion': CRITERION, 'seeds': list(seeds), 'rows': [r._asdict() for r in rows]}
    write_file(folder / 'scores.json', json.dumps(table, indent=2) + '\n')
    text = io.StringIO()
    # A figure that was not reached is an empty cell.
    csv.writer(text, lineterminator='\n').writerows([ScoreRow._fields, *rows])
    write_file(folder / 'scores.csv', text.getvalue())
    blocks = []
    for title, header, lines in _tables(rows):
        table_lines = [header, ['---'] * len(header), *lines]
        table_text = '\n'.join(f'| {" | ".join(line)} |' for line in table_lines)
        blocks.append(f'**{title}**\n\n{table_text}\n')
    write_file(folder / 'scores.md', '\n'.join(blocks))


def score_tables(rows: Sequence[ScoreRow]) -> Iterator[Table]:
    """Yield a table for each stage of each task: a line a learner, a column a mark."""
    for title, header, lines in _tables(rows):
        table = Table(title=title, title_justify='left')
        for column in header:
            table.add_column(column, overflow='fold')
        for line in lines:
            table.add_row(*line)
        yield table


def _tables(rows: Sequence[ScoreRow]) -> Iterator[tuple[str, list[str], list[list[str]]]]:
    """Yield title, header and lines of each table."""
    tables: dict[tuple[str, str], list[ScoreRow]] = {}
    for row in rows:
        tables.setdefault((row.task, row.stage), []).append(row)
    for (task, stage), found in tables.items():
        by_learner = [list(lines) for _, lines in groupby(found, lambda row: row.learner)]
        marks = find_task(task).stages[stage != 'first']
        columns = [f'{mark} trials' for mark in marks]
        columns += [row.quantity for row in by_learner[0][len(marks) :]]
        header = ['learner', 'track', *columns]
        lines = []
        for cells in by_learner:
            learner, scale = cells[0].learner, cells[-1].trials // marks[-1]
            name = learner if scale == 1 else f'{learner}, {scale} times the trials'
            lines.append([name, cells[0].track, *map(str, cells)])
        yield f'{task}, {stage} ({cells[0].seeds} seeds)', header, lines
