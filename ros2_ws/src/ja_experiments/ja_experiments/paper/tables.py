"""Make the tables of the report, as Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ja_common.core.statistics import over_seeds, wilson_interval
from ja_experiments.paper.episodes import Episode
from ja_experiments.paper.experiment import BLOCKS, STAGES, Condition
from ja_experiments.paper.study import Study

LOOKS = ('pool', 'fresh')
Rows = Sequence[Sequence[str]]


def report_tables(study: Study) -> dict[str, Any]:
    """Return every table of the report template, as Markdown; `ablations` by reading."""
    return {
        'online': _online(study),
        'alone': _alone(study),
        'stages': _stages(study),
        'pan_and_tilt': _pan_and_tilt(study),
        'episodes': _episodes(study) if study.episodes else '',
        'ablations': {name: _ablations(found) for name, found in study.ablations.items()},
        'seconds': _table(
            ('part', 'time'), [(part, f'{s:.1f} s') for part, s in study.seconds.items()]
        ),
    }


def _online(study: Study) -> str:
    header = ('pairs', 'objects', 'start', 'middle', 'end', 'end, in view', 'end, out of view')
    return _table(
        header,
        [
            (
                *names,
                *(str(over_seeds(condition.online(block))) for block in (0, BLOCKS // 2, -1)),
                *(str(over_seeds(condition.online(-1, in_view))) for in_view in (True, False)),
            )
            for names, condition in _each(study)
        ],
    )


def _alone(study: Study) -> str:
    views = ('', ', in view', ', out of view')
    header = ('pairs', 'objects', *(f'{looks}{view}' for looks in LOOKS for view in views))
    return _table(
        header,
        [
            (*names, *_alone_cells(condition, 'end', (None, True, False)))
            for names, condition in _each(study)
        ],
    )


def _stages(study: Study) -> str:
    views = (', in view', ', out of view')
    header = ('pairs', 'after stage', *(f'{looks}{view}' for looks in LOOKS for view in views))
    return _table(
        header,
        [
            (name, stage, *_alone_cells(condition, stage, (True, False)))
            for name, condition in study.featured().items()
            for stage in STAGES
        ],
    )


def _each(study: Study) -> Iterator[tuple[tuple[str, str], Condition]]:
    for name, conditions in study.by_objects.items():
        for objects, condition in conditions.items():
            yield (name, str(objects)), condition


def _alone_cells(condition: Condition, stage: str, views: Sequence[bool | None]) -> Iterator[str]:
    for looks in LOOKS:
        for in_view in views:
            yield str(over_seeds(condition.alone(stage, looks, in_view)))


def _pan_and_tilt(study: Study) -> str:
    rows = []
    for name, condition in study.featured().items():
        for stage, block in {'block 1': 0, **STAGES, 'end': BLOCKS - 1}.items():
            explained = np.array([run.explained[block, 0] for run in condition.runs])
            first = np.mean(explained[:, 0] > explained[:, 1])
            cells = [f'{value:.2f}' for value in explained.mean(axis=0)]
            rows.append((name, stage, *cells, f'{first:.0%}'))
    header = ('pairs', 'after', 'pan explained', 'tilt explained', 'seeds with pan ahead')
    return _table(header, rows)


def _episodes(study: Study) -> str:
    header = ('pairs', 'trials', 'success', '95 % (Wilson)', 'shifts of the successes')
    return _table(header, [(name, *_episode_cells(e)) for name, e in study.episodes.items()])


def _episode_cells(episodes: Sequence[Episode]) -> tuple[str, ...]:
    successes = [episode for episode in episodes if episode.success]
    low, high = wilson_interval(len(successes), len(episodes))
    counts = np.bincount([episode.shifts for episode in successes], minlength=2)
    by_shifts = ', '.join(f'{count} with {n}' for n, count in enumerate(counts) if count)
    interval = f'{low:.2f}-{high:.2f}'
    return str(len(episodes)), f'{len(successes) / len(episodes):.2f}', interval, by_shifts


def _ablations(variants: Mapping[str, Condition]) -> str:
    header = ('variant', 'online', 'alone, pool', 'pool, out of view', 'alone, fresh')
    return _table(
        header,
        [
            (
                label,
                str(over_seeds(condition.online(-1))),
                str(over_seeds(condition.alone('end', 'pool'))),
                str(over_seeds(condition.alone('end', 'pool', in_view=False))),
                str(over_seeds(condition.alone('end', 'fresh'))),
            )
            for label, condition in variants.items()
        ],
    )


def _table(header: Sequence[str], rows: Rows) -> str:
    lines = [header, ['---', *['---:'] * (len(header) - 1)], *rows]
    return '\n'.join(f'| {" | ".join(line)} |' for line in lines)
