"""Grids of experiments over seeds and parameters, on local processes or on a Dask cluster.

A cell is one run: one set of settings, one seed. Its row is written to its own file as soon as it
is finished. A sweep that was killed continues with the missing cells. At the end all rows become
one Parquet table.

    reading: last           # 'all' or 'last' pairs; where the grid starts from
    trials: 300000
    seeds: 5                # or a list
    scene: default
    grid:                   # any parameter of the experiment, by its name
      objects: [1, 5, 10]
      learning_rate: [0.003, 0.01]
"""

from __future__ import annotations

import hashlib
import itertools
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.parquet
import yaml
from distributed import Client, LocalCluster, as_completed

from ja_common.core.config import ConfigError
from ja_experiments.config import READINGS, ExperimentConfig, reading
from ja_experiments.paper.experiment import BLOCKS, STAGES, Materials, Plan, run_seed
from ja_experiments.progress_bars import ProgressBars

TABLE_NAME = 'results.parquet'
_CELLS = 'cells'


@dataclass(frozen=True)
class Cell:
    """One run of a sweep: its changes to the reading, and its seed."""

    reading: str
    trials: int
    settings: dict[str, Any]
    seed: int

    def config(self) -> ExperimentConfig:
        """Return the configuration of the run."""
        return reading(self.reading).with_settings(self.settings)


@dataclass(frozen=True)
class Grid:
    """A sweep: its cells, and the scene of the looks that all of them learn from."""

    scene: str
    cells: tuple[Cell, ...]


def read_grid(path: Path) -> Grid:
    """Read a sweep from YAML. Raises ConfigError that names the file and the error."""
    try:
        text = yaml.safe_load(path.read_text(encoding='utf-8'))
    except (OSError, yaml.YAMLError) as error:
        raise ConfigError(f'{path} cannot be read: {error}') from None
    known = {'reading': 'all', 'trials': 300_000, 'seeds': 10, 'scene': 'default', 'grid': {}}
    if not isinstance(text, dict) or not set(text) <= set(known):
        raise ConfigError(f'{path} must hold a table with {", ".join(known)} and nothing else')
    given = {**known, **text}
    if given['reading'] not in READINGS:
        raise ConfigError(f'{path}: reading must be one of {", ".join(READINGS)}')
    seeds = range(given['seeds']) if isinstance(given['seeds'], int) else given['seeds']
    cells = [
        Cell(given['reading'], given['trials'], settings, seed)
        for settings in _combinations(given['grid'])
        for seed in seeds
    ]
    for cell in cells:
        try:
            cell.config()
        except ConfigError as error:
            raise ConfigError(f'{path}: {error}') from None
    return Grid(given['scene'], tuple(cells))


def _combinations(axes: dict[str, list[Any]]) -> Iterator[dict[str, Any]]:
    values = [axis if isinstance(axis, list) else [axis] for axis in axes.values()]
    for chosen in itertools.product(*values):
        yield dict(zip(axes, chosen, strict=True))


def run_sweep(
    grid: Grid,
    materials: Materials,
    folder: Path,
    progress: ProgressBars,
    scheduler: str | None = None,
    workers: int = 1,
) -> Path:
    """Run the cells that `folder` does not hold yet; return the path of the table of all cells.

    `scheduler`: address of a Dask scheduler, whose workers must have these packages installed;
    None starts `workers` local processes. If a worker dies, its cell is run on another one.
    """
    (folder / _CELLS).mkdir(parents=True, exist_ok=True)
    files = {folder / _CELLS / f'{_key(cell, materials)}.json': cell for cell in grid.cells}
    missing = {path: cell for path, cell in files.items() if not path.exists()}
    if missing:
        with _client(scheduler, workers) as client:
            _run_cells(client, missing, materials, progress)
    rows = [json.loads(path.read_text(encoding='utf-8')) for path in files]
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(rows), folder / TABLE_NAME)
    return folder / TABLE_NAME


def run_cell(cell: Cell, materials: Materials) -> dict[str, Any]:
    """Run one cell; return its row: settings, seed, online success by block, learner alone."""
    config, plan = cell.config(), Plan(trials=cell.trials, seeds=(cell.seed,))
    run = run_seed(config, plan, materials, cell.seed)
    success = run.online.success[: BLOCKS * plan.block].reshape(BLOCKS, plan.block)
    alone = {
        f'alone_{stage}_{looks}': float(outcomes.success.mean())
        for stage in (*STAGES, 'end')
        for looks, outcomes in run.alone[stage].items()
    }
    return {
        'reading': cell.reading,
        'trials': cell.trials,
        'seed': cell.seed,
        **config.settings(),
        'online_start': float(success[0].mean()),
        'online_end': float(success[-1].mean()),
        **alone,
        'online_by_block': success.mean(axis=1).tolist(),
    }


def _run_cells(
    client: Client, cells: dict[Path, Cell], materials: Materials, progress: ProgressBars
) -> None:
    # One copy per worker, pinned to none: the death of a worker loses no data.
    shared = client.submit(lambda: materials, pure=False)
    jobs = {
        client.submit(run_cell, cell, shared, pure=False): path for path, cell in cells.items()
    }
    with progress.bar('cells', len(cells)) as advance:
        for job, row in as_completed(jobs, with_results=True):
            _write_row(jobs[job], row)
            advance(1)


def _write_row(path: Path, row: dict[str, Any]) -> None:
    """Write the row of a finished cell in one atomic step."""
    temporary = path.with_suffix(f'.{os.getpid()}')
    temporary.write_text(json.dumps(row), encoding='utf-8')
    os.replace(temporary, path)


def _key(cell: Cell, materials: Materials) -> str:
    """Return a name that depends on the run and the looks only, not on the rest of the sweep."""
    run = [cell.reading, cell.trials, cell.config().settings(), cell.seed, repr(materials.places)]
    digest = hashlib.sha256(json.dumps(run, sort_keys=True).encode())
    for looks in (materials.pool, materials.fresh):
        for array in (looks.faces, looks.faces_at, looks.postures, looks.directions):
            digest.update(array.tobytes())
    return digest.hexdigest()[:16]


@contextmanager
def _client(scheduler: str | None, workers: int) -> Iterator[Client]:
    if scheduler is not None:
        with Client(scheduler) as client:
            yield client
        return
    with (
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address='127.0.0.1:0',
            silence_logs='ERROR',
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client
