"""What a sweep consists of: its cells, read from a YAML file.

reading: last           # 'all' or 'last' pairs, and
values: first           # 'first' or 'chosen' values: where the grid starts from
trials: 300000
seeds: 5                # or a list
scene: default
looks_seed: 0           # seed of the caregiver
grid:                   # any parameter of the experiment, by its name
  objects: [1, 5, 10]
  learning_rate: [0.003, 0.01]
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.core.safe_files import load_yaml
from ja_experiments.config import READINGS, VALUES, ExperimentConfig, reading

MOST_CELLS = 100_000
_LARGEST_SEED = 2**32 - 1


@dataclass(frozen=True)
class SweepConfig(Configuration):
    """What all cells of a sweep share."""

    reading: str = parameter('all', 'where the grid starts from', choices=tuple(READINGS))
    values: str = parameter(
        'first', 'values of the reading that the grid starts from', choices=tuple(VALUES)
    )
    trials: int = parameter(300_000, 'trials of each run', low=3000, high=10**9)
    scene: str = parameter('default', 'scene of the looks, by name or file')
    looks_seed: int = parameter(0, 'seed of the caregiver', low=0, high=_LARGEST_SEED)


@dataclass(frozen=True)
class Cell:
    """One run of a sweep: its changes to the reading, and its seed."""

    reading: str
    values: str
    trials: int
    settings: dict[str, Any]
    seed: int

    def config(self) -> ExperimentConfig:
        """Return the configuration of the run."""
        return reading(self.reading, self.values).with_settings(self.settings)


@dataclass(frozen=True)
class Grid:
    """A sweep: its cells, and the scene and seed of the looks that all of them learn from."""

    scene: str
    looks_seed: int
    cells: tuple[Cell, ...]


def read_grid(path: Path) -> Grid:
    """Read a sweep from YAML. Raises ConfigError that names the file and the error."""
    table = load_yaml(path)
    try:
        return _grid(table)
    except ConfigError as error:
        raise ConfigError(f'{path}: {error}') from None


def _grid(table: dict[str, Any]) -> Grid:
    shared = {field.name for field in fields(SweepConfig)}
    known = [*sorted(shared), 'seeds', 'grid']
    if unknown := [name for name in table if name not in known]:
        raise ConfigError(
            f'{unknown[0][:50]!r} is no setting of a sweep; there are {", ".join(known)} and '
            'nothing else'
        )
    config = SweepConfig(**{name: value for name, value in table.items() if name in shared})
    seeds = _seeds(table.get('seeds', 10))
    axes = _axes(table.get('grid', {}))
    count = len(seeds) * math.prod(len(axis) for axis in axes.values())
    if count > MOST_CELLS:
        raise ConfigError(f'the grid has {count} cells; {MOST_CELLS} are the most')
    cells = []
    for chosen in itertools.product(*axes.values()):
        settings = dict(zip(axes, chosen, strict=True))
        of_one = [
            Cell(config.reading, config.values, config.trials, settings, seed) for seed in seeds
        ]
        of_one[0].config()  # the parameters and their ranges are checked here
        cells += of_one
    return Grid(config.scene, config.looks_seed, tuple(cells))


def _seeds(given: Any) -> list[int]:
    """Return the seeds: so many from 0 on, or those of a list."""
    if type(given) is int and 1 <= given <= MOST_CELLS:
        return list(range(given))
    if not isinstance(given, list) or not given:
        raise ConfigError(
            f'seeds = {given!r:.50} is neither a number from 1 to {MOST_CELLS} nor a list of seeds'
        )
    for seed in given:
        if type(seed) is not int or not 0 <= seed <= _LARGEST_SEED:
            raise ConfigError(f'seeds: {seed!r:.50} is no whole number from 0 to {_LARGEST_SEED}')
    _check_distinct('seeds', given)
    return given


def _axes(given: Any) -> dict[str, list[Any]]:
    """Return the values of each parameter; one value may stand alone."""
    if not isinstance(given, dict):
        raise ConfigError(f'grid = {given!r:.50} is no table of parameters (name: values)')
    axes = {name: value if isinstance(value, list) else [value] for name, value in given.items()}
    for name, values in axes.items():
        if not isinstance(name, str):
            raise ConfigError(f'grid: {name!r:.50} is no name of a parameter')
        if not values:
            raise ConfigError(f'grid: {name} has no values')
        for value in values:
            if not isinstance(value, (str, int, float)):
                raise ConfigError(f'grid: {value!r:.50} is no value for {name}')
        _check_distinct(f'grid: {name}', values)
    return axes


def _check_distinct(name: str, values: list[Any]) -> None:
    for number, value in enumerate(values):
        if value in values[:number]:
            raise ConfigError(f'{name}: {value!r:.50} is given twice')
