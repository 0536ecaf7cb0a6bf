"""Compute all of `./ja figures`: both readings of the paper, and the ablations on demand."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Any

import torch

from ja_common.core.safe_files import load_yaml
from ja_experiments.config import READINGS, reading
from ja_experiments.datasets.looks import FRESH, POOL, load_looks
from ja_experiments.datasets.recorded import recorded_materials
from ja_experiments.paper.episodes import Episode, record_episodes
from ja_experiments.paper.experiment import Condition, Materials, Plan, run_conditions
from ja_experiments.progress_bars import ProgressBars
from ja_sim.core.scene import load_scene

OBJECTS = (1, 3, 5, 10)
FEATURED_OBJECTS = 5
"""The number of objects in Figures 6 (c) and 7, the stages and the ablations."""


@dataclass(frozen=True)
class StudyConfig:
    """What to compute. No ablations when `ablation_seeds` is 0.

    `values`: one of the `VALUES`. `looks_seed`: seed of the caregiver. `data`: folder of a
    recorded data set, in place of a rendered caregiver; then there is no Figure 7, because the
    world around her is not known.
    `pool`: looks of the data to learn from; 0: as many as the paper, or four fifths of them.
    `episodes`: number of trials for Figure 7.
    """

    plan: Plan = field(default_factory=Plan)
    values: str = 'first'
    scene: str = 'default'
    looks_seed: int = 0
    data: str = ''
    pool: int = 0
    episodes: int = 40
    ablation_seeds: int = 0
    workers: int = os.cpu_count() or 1


@dataclass(frozen=True)
class Study:
    """The results; conditions by reading, then by object count or by variant."""

    config: StudyConfig
    materials: Materials
    by_objects: dict[str, dict[int, Condition]]
    episodes: dict[str, list[Episode]]
    ablations: dict[str, dict[str, Condition]]
    seconds: dict[str, float]

    def featured(self) -> dict[str, Condition]:
        """Return the condition with `FEATURED_OBJECTS` of each reading."""
        return {name: found[FEATURED_OBJECTS] for name, found in self.by_objects.items()}


def run_study(
    config: StudyConfig, progress: ProgressBars, materials: Materials | None = None
) -> Study:
    """Compute everything, and measure the time of each part in `seconds`.

    `materials`: the looks to use; None: those that the configuration names.
    """
    torch.set_num_threads(1)
    seconds: dict[str, float] = {}
    with _timed(seconds, 'looks at the caregiver'):
        materials = materials or _materials_of(config, progress)
    with _timed(seconds, 'compilation'):
        compile_kernel(materials)
    by_objects, episodes, ablations = {}, {}, {}
    for name in READINGS:
        with _timed(seconds, f'figure 6, pairs: {name}'):
            by_objects[name] = _figure_6(name, config, materials, progress)
    for name in () if config.data else READINGS:
        with _timed(seconds, f'figure 7, pairs: {name}'):
            featured = by_objects[name][FEATURED_OBJECTS]
            episodes[name] = _figure_7(name, featured, config, progress)
    for name in READINGS if config.ablation_seeds else ():
        with _timed(seconds, f'ablations, pairs: {name}'):
            ablations[name] = _ablations(name, config, materials, progress)
    return Study(config, materials, by_objects, episodes, ablations, seconds)


def _materials_of(config: StudyConfig, progress: ProgressBars) -> Materials:
    if config.data:
        return recorded_materials(Path(config.data), config.pool, config.scene)
    return prepare_materials(config.scene, config.looks_seed, progress)


@contextmanager
def _timed(seconds: dict[str, float], part: str) -> Iterator[None]:
    start = time.perf_counter()
    yield
    seconds[part] = time.perf_counter() - start


def compile_kernel(materials: Materials) -> None:
    """Compile the kernel, or load it from the cache, before times are measured."""
    run_conditions({'': reading('all')}, Plan(trials=30, seeds=(0,), test_trials=1), materials)


def read_ablations(path: Path | None = None) -> dict[str, dict[str, Any]]:
    """Return settings by the name of the variant, from a YAML file or from the package's own."""
    shipped = resources.files('ja_experiments.paper') / 'ablations.yaml'
    return load_yaml(path or Path(str(shipped)))


def prepare_materials(scene: str, looks_seed: int, progress: ProgressBars) -> Materials:
    """Return the looks of a scene, rendered if they are not cached, and its object ranges."""
    with progress.bar('looks at the caregiver', POOL + FRESH) as advance:
        looks = load_looks(scene, looks_seed, report=progress.print_line, progress=advance)
    origin = (
        f'looks at a rendered caregiver (scene `{scene}`, seed {looks_seed}), through the face '
        'detector and the crop of the live graph'
    )
    return Materials.from_looks(looks, load_scene(scene).objects, origin)


def _figure_6(
    name: str, config: StudyConfig, materials: Materials, progress: ProgressBars
) -> dict[int, Condition]:
    configs = {str(n): reading(name, config.values).with_settings({'objects': n}) for n in OBJECTS}
    with progress.bar(f'figure 6, pairs: {name}', _trials(configs, config.plan)) as advance:
        found = run_conditions(configs, config.plan, materials, config.workers, advance)
    return {n: found[str(n)] for n in OBJECTS}


def _figure_7(
    name: str, condition: Condition, config: StudyConfig, progress: ProgressBars
) -> list[Episode]:
    with progress.bar(f'figure 7, pairs: {name}', config.episodes) as advance:
        return record_episodes(
            condition.config,
            condition.runs[0].network,
            config.scene,
            config.looks_seed,
            config.episodes,
            advance,
        )


def _ablations(
    name: str, config: StudyConfig, materials: Materials, progress: ProgressBars
) -> dict[str, Condition]:
    base = reading(name, config.values).with_settings({'objects': FEATURED_OBJECTS})
    configs = {label: base.with_settings(changed) for label, changed in read_ablations().items()}
    plan = replace(config.plan, seeds=config.plan.seeds[: config.ablation_seeds])
    with progress.bar(f'ablations, pairs: {name}', _trials(configs, plan)) as advance:
        return run_conditions(configs, plan, materials, config.workers, advance)


def _trials(configs: dict[str, Any], plan: Plan) -> int:
    return len(configs) * len(plan.seeds) * plan.trials
