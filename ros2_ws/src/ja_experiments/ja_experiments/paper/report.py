"""A study as a folder: report.md, report.html, pictures, configuration and all numbers."""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from importlib import metadata, resources
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jinja2 import Environment, StrictUndefined
from markdown_it import MarkdownIt
from matplotlib.figure import Figure

from ja_common.core.statistics import Estimate, over_seeds, wilson_interval
from ja_experiments.paper import figures
from ja_experiments.paper.experiment import BLOCKS, STAGES, Condition
from ja_experiments.paper.strips import Episode, image_strips, most_telling
from ja_experiments.paper.study import FEATURED_OBJECTS, OBJECTS, Study

_LIBRARIES = ('numpy', 'numba', 'torch', 'mujoco', 'opencv-python-headless', 'scipy')
_STRIP_ROWS = 3
_LOOKS = ('pool', 'fresh')
_STYLE = (
    'body{max-width:60rem;margin:2rem auto;padding:0 1rem;font:16px/1.5 system-ui,sans-serif}'
    'img{max-width:100%}table{border-collapse:collapse;margin:1rem 0}'
    'th,td{padding:.2rem .7rem;border-bottom:1px solid #ccc;text-align:right}'
    'th:first-child,td:first-child{text-align:left}'
)
Rows = Sequence[Sequence[str]]


def write_report(study: Study, folder: Path) -> Path:
    """Write everything into a folder, which is made; the path of report.md."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, picture in _pictures(study).items():
        picture.savefig(folder / f'{name}.png')
    text = _markdown(study)
    (folder / 'report.md').write_text(text, encoding='utf-8')
    (folder / 'report.html').write_text(_html(text), encoding='utf-8')
    config = yaml.safe_dump(_configuration(study), sort_keys=False, allow_unicode=True)
    (folder / 'config.yaml').write_text(config, encoding='utf-8')
    numbers = json.dumps(_numbers(study), indent=1)
    (folder / 'results.json').write_text(numbers, encoding='utf-8')
    return folder / 'report.md'


def _pictures(study: Study) -> dict[str, Figure]:
    featured = study.featured()
    pictures = {
        'figure-6a': figures.gating_function(featured),
        'figure-6b': figures.success_over_time(study.by_objects),
        'stages': figures.frozen_stages(featured),
        'pan-and-tilt': figures.pan_and_tilt(featured),
    }
    for name, condition in featured.items():
        pictures[f'figure-6c-{name}'] = figures.attended_pan(condition)
        chosen = most_telling(study.episodes.get(name, []), _STRIP_ROWS)
        if chosen:
            pictures[f'figure-7-{name}'] = image_strips(chosen, condition.config)
    for name, variants in study.ablations.items():
        title = f'pairs: {name}, {FEATURED_OBJECTS} objects'
        pictures[f'ablations-{name}'] = figures.ablation_bars(variants, title)
    return pictures


def _markdown(study: Study) -> str:
    template = (resources.files('ja_experiments.paper') / 'report_template.md').read_text('utf-8')
    plan = study.config.plan
    return (
        Environment(undefined=StrictUndefined)
        .from_string(template)
        .render(
            study=study.config,
            plan=plan,
            pool=len(study.materials.pool),
            fresh=len(study.materials.fresh),
            origin=study.materials.origin,
            featured=FEATURED_OBJECTS,
            readings=list(study.by_objects),
            strips=[
                name for name, found in study.episodes.items() if any(e.success for e in found)
            ],
            learned=len(OBJECTS) * len(plan.seeds) * plan.trials,
            versions=_versions(),
            tables={
                'online': _online(study),
                'alone': _alone(study),
                'stages': _stages(study),
                'pan_and_tilt': _pan_and_tilt(study),
                'episodes': _episodes(study) if study.episodes else '',
                'ablations': {name: _ablations(found) for name, found in study.ablations.items()},
                'seconds': _table(
                    ('part', 'time'), [(part, f'{s:.1f} s') for part, s in study.seconds.items()]
                ),
            },
        )
    )


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
    header = ('pairs', 'objects', *(f'{looks}{view}' for looks in _LOOKS for view in views))
    return _table(
        header,
        [
            (*names, *_alone_cells(condition, 'end', (None, True, False)))
            for names, condition in _each(study)
        ],
    )


def _stages(study: Study) -> str:
    views = (', in view', ', out of view')
    header = ('pairs', 'after stage', *(f'{looks}{view}' for looks in _LOOKS for view in views))
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
    for looks in _LOOKS:
        for in_view in views:
            yield str(over_seeds(condition.alone(stage, looks, in_view)))


def _pan_and_tilt(study: Study) -> str:
    rows = []
    for name, condition in study.featured().items():
        for stage, block in {'block 1': 0, **STAGES, 'end': BLOCKS - 1}.items():
            known = np.array([run.explained[block, 0] for run in condition.runs])
            first = np.mean(known[:, 0] > known[:, 1])
            cells = [f'{value:.2f}' for value in known.mean(axis=0)]
            rows.append((name, stage, *cells, f'{first:.0%}'))
    header = ('pairs', 'after', 'pan explained', 'tilt explained', 'seeds that know more of pan')
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


def _versions() -> dict[str, str]:
    found = {library: metadata.version(library) for library in _LIBRARIES}
    return {'Python': platform.python_version(), **found, 'machine': platform.machine()}


def _configuration(study: Study) -> dict[str, Any]:
    plan = study.config.plan
    return {
        'versions': _versions(),
        'study': {**asdict(study.config), 'plan': {**asdict(plan), 'seeds': list(plan.seeds)}},
        'readings': {
            name: plan.of(condition.config).settings()
            for name, condition in study.featured().items()
        },
        'objects': list(OBJECTS),
    }


def _numbers(study: Study) -> dict[str, Any]:
    return {
        'seconds': study.seconds,
        'figure 6': {
            f'pairs {name}, {objects} objects': _condition_numbers(condition)
            for name, conditions in study.by_objects.items()
            for objects, condition in conditions.items()
        },
        'figure 7': {
            f'pairs {name}': [
                {'success': e.success, 'in_view': e.in_view, 'shifts': e.shifts} for e in episodes
            ]
            for name, episodes in study.episodes.items()
        },
        'ablations': {
            f'pairs {name}': {key: _condition_numbers(found) for key, found in variants.items()}
            for name, variants in study.ablations.items()
        },
    }


def _condition_numbers(condition: Condition) -> dict[str, Any]:
    """Per seed, so that anybody can take other statistics."""
    views: Mapping[str, bool | None] = {'all': None, 'in view': True, 'out of view': False}
    return {
        'online, by seed and block': condition.curve.round(4).tolist(),
        'online at the end': {
            view: _estimate(over_seeds(condition.online(-1, flag))) for view, flag in views.items()
        },
        'alone': {
            f'{stage}, {looks}, {view}': _plain(condition.alone(stage, looks, flag))
            for stage in condition.runs[0].alone
            for looks in _LOOKS
            for view, flag in views.items()
        },
        'explained variance, by seed, block, looks (pool, fresh) and axis (pan, tilt)': [
            run.explained.round(4).tolist() for run in condition.runs
        ],
    }


def _estimate(estimate: Estimate) -> dict[str, float | None]:
    numbers = asdict(estimate)
    return dict(zip(numbers, _plain(numbers.values()), strict=True))


def _plain(numbers: Iterable[float]) -> list[float | None]:
    """For JSON, which has no word for 'not a number'."""
    return [None if math.isnan(number) else round(float(number), 5) for number in numbers]


def _table(header: Sequence[str], rows: Rows) -> str:
    lines = [header, ['---', *['---:'] * (len(header) - 1)], *rows]
    return '\n'.join(f'| {" | ".join(line)} |' for line in lines)


def _html(text: str) -> str:
    body = MarkdownIt('commonmark').enable('table').render(text)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<title>Joint attention: the experiment</title><style>{_STYLE}</style></head>'
        f'<body>{body}</body></html>\n'
    )
