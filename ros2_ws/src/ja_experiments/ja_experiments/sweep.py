"""Grids of experiments over seeds and parameters, on local processes or on a Dask cluster.

A cell is one run: one set of settings, one seed. Its row is written to its own file as soon as it
is finished. A sweep that was killed continues with the missing cells. At the end all rows become
one Parquet table.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.parquet
from distributed import Client, LocalCluster, as_completed

from ja_common.core.config import ConfigError
from ja_common.core.files import write_file
from ja_common.core.safe_files import load_json
from ja_experiments.paper.experiment import BLOCKS, STAGES, Materials, Plan, run_seed
from ja_experiments.progress_bars import ProgressBars
from ja_experiments.sweep_grid import Cell, Grid

TABLE_NAME = 'results.parquet'
_CELLS = 'cells'


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
    pyarrow.parquet.write_table(_table(files), folder / TABLE_NAME)
    return folder / TABLE_NAME


def _table(files: Iterable[Path]) -> pyarrow.Table:
    """Return the rows of all cells. Raises ConfigError when one of the files is damaged."""
    try:
        return pyarrow.Table.from_pylist([load_json(path) for path in files])
    except (ConfigError, pyarrow.ArrowException) as error:
        raise ConfigError(
            f'{error}: delete the damaged cell, and the same command runs it again'
        ) from None


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
    """Write the row of a finished cell, whole or not at all. Raises SaveError."""
    write_file(path, json.dumps(row))


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
        try:
            client = Client(scheduler)
        except (OSError, ValueError) as error:
            raise ConfigError(f'no Dask scheduler at {scheduler}: {error}') from None
        with client:
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
