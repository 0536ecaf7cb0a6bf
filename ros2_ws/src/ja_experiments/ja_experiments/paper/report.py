"""Write a study to a folder: report.md, report.html, pictures, configuration, all numbers."""

from __future__ import annotations

import io
import json
import math
import platform
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from importlib import metadata, resources
from pathlib import Path
from typing import Any

import cv2
import yaml
from jinja2 import Environment, StrictUndefined
from markdown_it import MarkdownIt
from matplotlib.figure import Figure

from ja_common.core.files import write_file
from ja_common.core.statistics import Estimate, over_seeds
from ja_common.core.weight_files import note_weight_files, weight_files_text
from ja_experiments.paper import figures
from ja_experiments.paper.episodes import choose_examples
from ja_experiments.paper.experiment import Condition
from ja_experiments.paper.strips import image_strips
from ja_experiments.paper.study import FEATURED_OBJECTS, OBJECTS, Study
from ja_experiments.paper.tables import LOOKS, report_tables
from ja_learning.core.network_config import NetworkConfig
from ja_learning.core.track import Track
from ja_perception.core.blazeface import BlazeFace

_LIBRARIES = ('numpy', 'numba', 'torch', 'mujoco', 'scipy')
_STRIP_ROWS = 3
TRACK = str(Track.of_learner(NetworkConfig()))
"""The paper's network starts from random weights and learns from its own trials."""
_STYLE = (
    'body{max-width:60rem;margin:2rem auto;padding:0 1rem;font:16px/1.5 system-ui,sans-serif}'
    'img{max-width:100%}table{border-collapse:collapse;margin:1rem 0}'
    'th,td{padding:.2rem .7rem;border-bottom:1px solid #ccc;text-align:right}'
    'th:first-child,td:first-child{text-align:left}'
)


def write_report(study: Study, folder: Path) -> Path:
    """Write the report to a folder, which is created; return the path of report.md.

    Raises SaveError.
    """
    # First the numbers: a disk that gets full costs pictures rather than them.
    write_file(folder / 'results.json', json.dumps(_numbers(study), indent=1))
    config = yaml.safe_dump(_configuration(study), sort_keys=False, allow_unicode=True)
    write_file(folder / 'config.yaml', config)
    text = _markdown(study)
    write_file(folder / 'report.md', text)
    write_file(folder / 'report.html', _html(text))
    for name, picture in _pictures(study).items():
        image = io.BytesIO()
        picture.savefig(image, format='png')
        write_file(folder / f'{name}.png', image.getvalue())
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
        chosen = choose_examples(study.episodes.get(name, []), _STRIP_ROWS)
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
            track=TRACK,
            weight_files=weight_files_text(_weight_files(study)) or 'not known',
            tables=report_tables(study),
        )
    )


def _versions() -> dict[str, str]:
    found = {library: metadata.version(library) for library in _LIBRARIES}
    # Not by metadata: OpenCV comes in packages of several names.
    found['opencv'] = cv2.__version__
    return {'Python': platform.python_version(), **found, 'machine': platform.machine()}


def _configuration(study: Study) -> dict[str, Any]:
    plan = study.config.plan
    return {
        'versions': _versions(),
        'track': TRACK,
        'weight_files': _weight_files(study),
        'study': {**asdict(study.config), 'plan': {**asdict(plan), 'seeds': list(plan.seeds)}},
        'readings': {
            name: plan.scale_gate(condition.config).settings()
            for name, condition in study.featured().items()
        },
        'objects': list(OBJECTS),
    }


def _weight_files(study: Study) -> dict[str, str]:
    """Return name and SHA-256 of the weight files that made the looks; recorded looks: none known.

    Rendered looks are kept only as long as the perception that made them is the installed one.
    """
    if study.config.data:
        return {}
    with note_weight_files() as files:
        BlazeFace()
    return files


def _numbers(study: Study) -> dict[str, Any]:
    return {
        'seconds': study.seconds,
        'track': TRACK,
        'weight_files': _weight_files(study),
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
    """Return the numbers of every seed, so that a reader can compute other statistics."""
    views: Mapping[str, bool | None] = {'all': None, 'in view': True, 'out of view': False}
    return {
        'online, by seed and block': condition.curve.round(4).tolist(),
        'online at the end': {
            view: _estimate(over_seeds(condition.online(-1, flag))) for view, flag in views.items()
        },
        'alone': {
            f'{stage}, {looks}, {view}': _plain(condition.alone(stage, looks, flag))
            for stage in condition.runs[0].alone
            for looks in LOOKS
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
    """Return rounded numbers for JSON, with None for NaN."""
    return [None if math.isnan(number) else round(float(number), 5) for number in numbers]


def _html(text: str) -> str:
    body = MarkdownIt('commonmark').enable('table').render(text)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<title>Joint attention: the experiment</title><style>{_STYLE}</style></head>'
        f'<body>{body}</body></html>\n'
    )
