"""Sweeps: finished cells are kept; the death of a process costs only its current cell."""

import multiprocessing
import os
import signal
import time
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest
from distributed import LocalCluster

from ja_common.core.config import ConfigError
from ja_experiments.config import READINGS, VALUES, reading
from ja_experiments.datasets.looks import Looks
from ja_experiments.paper.choice import rank_candidates
from ja_experiments.paper.experiment import BLOCKS, Materials
from ja_experiments.progress_bars import ProgressBars
from ja_experiments.sweep import _key as cell_key
from ja_experiments.sweep import run_cell, run_sweep
from ja_experiments.sweep_grid import Grid, read_grid
from ja_sim.core.specs import ObjectsSpec
from ros_testing import PATIENCE_S

TRIALS = 30_000


@pytest.fixture
def materials(looks: Looks, places: ObjectsSpec) -> Materials:
    return Materials(looks[:100], looks[100:], places)


def grid_file(folder: Path, seeds: int) -> Path:
    path = folder / 'sweep.yaml'
    path.write_text(
        f'reading: last\ntrials: {TRIALS}\nseeds: {seeds}\n'
        'grid: {objects: [1, 5], learning_rate: 0.02}\n'
    )
    return path


def cell_files(folder: Path) -> dict[Path, int]:
    """Return the finished cells, and when each was written."""
    return {path: path.stat().st_mtime_ns for path in folder.glob('cells/*.json')}


def wait_for_cells(folder: Path, count: int) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while len(cell_files(folder)) < count:
        assert time.monotonic() < deadline, 'no cell was finished in time'
        time.sleep(0.01)


def sweep_in_child(grid: Grid, materials: Materials, folder: Path, address: str) -> None:
    run_sweep(grid, materials, folder, ProgressBars(), scheduler=address)


def test_a_grid_is_every_combination_with_every_seed(tmp_path: Path) -> None:
    cells = read_grid(grid_file(tmp_path, seeds=3)).cells
    assert [(c.settings['objects'], c.seed) for c in cells] == [
        (1, 0), (1, 1), (1, 2), (5, 0), (5, 1), (5, 2),
    ]  # fmt: skip
    assert {c.config().network.learning_rate for c in cells} == {0.02}
    assert {c.config().network.pairs for c in cells} == {'last'}


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('grid: {learning_rte: [0.1]}', 'learning_rte is no parameter'),
        ('grid: {objects: [1, many]}', "objects = 'many' is a str"),
        ('gird: {}', 'and nothing else'),
        ('reading: first', 'one of all, last'),
        ('reading: [all]', 'reading'),
        ('values: best', 'one of first, chosen'),
        ('looks_seed: -1', 'looks_seed = -1 is outside'),
        ('grid: {', 'not YAML'),
        ('- 1', 'a table of settings'),
        ('seeds: null', 'nor a list of seeds'),
        ('seeds: 0', 'nor a list of seeds'),
        ('seeds: -3', 'nor a list of seeds'),
        ('seeds: true', 'nor a list of seeds'),
        ('seeds: 2.0', 'nor a list of seeds'),
        ('seeds: []', 'nor a list of seeds'),
        ('seeds: {a: 1}', 'nor a list of seeds'),
        ('seeds: 99999999999', 'nor a list of seeds'),
        ('seeds: [1, x]', "'x' is no whole number"),
        ('seeds: [1, -1]', '-1 is no whole number'),
        ('seeds: [1, 1.5]', 'no whole number'),
        ('seeds: [[1]]', 'no whole number'),
        ('seeds: [3, 4, 3]', '3 is given twice'),
        ('grid: [1]', 'no table of parameters'),
        ('grid: null', 'no table of parameters'),
        ('grid: 5', 'no table of parameters'),
        ('grid: {objects: []}', 'objects has no values'),
        ('grid: {objects: [[1]]}', 'no value for objects'),
        ('grid: {objects: null}', 'no value for objects'),
        ('grid: {objects: {a: 1}}', 'no value for objects'),
        ('grid: {objects: [1, 5, 1]}', '1 is given twice'),
        ('grid: {objects: [0]}', 'objects = 0 is outside'),
        ('grid: {objects: [1000000000]}', 'objects = 1000000000 is outside'),
        ('grid: {learning_rate: [.nan]}', 'not a finite number'),
        ('grid: {learning_rate: [1.0e+999]}', 'not a finite number'),
        (f'grid: {{learning_rate: {10**400}}}', 'too large'),
        ('grid: {taught: [nothing]}', 'taught'),
        ('grid: {1: [2]}', 'no name of a parameter'),
        ('grid: {learner: [paper]}', 'learner is no parameter'),
        ('grid: {objects: 1, objects: 2}', "'objects' is given twice"),
        (f'seeds: 1000\ngrid: {{objects: {list(range(1, 101))}, max_shifts: [1, 2]}}', 'the most'),
        ('trials: 0', 'trials = 0 is outside'),
        ('trials: many', "trials = 'many' is a str"),
        ('trials: null', 'trials = None'),
        ('trials: 3.0e+5', 'trials = 300000.0 is a float'),
        ('scene: 5', 'scene = 5 is an int'),
        ('scene: [default]', 'scene'),
        ('a: &a [1]\nb: *a', 'an alias'),
    ],
)
def test_a_wrong_grid_is_refused_in_one_sentence(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / 'sweep.yaml'
    path.write_text(text)
    with pytest.raises(ConfigError, match=message) as refused:
        read_grid(path)
    assert str(path) in str(refused.value)
    assert '\n' not in str(refused.value)
    assert len(str(refused.value)) < 600


@pytest.mark.parametrize('damage', ['', '{"objects": ', '[1]', '\0'])
def test_a_damaged_cell_is_named_with_what_to_do(
    damage: str, tmp_path: Path, materials: Materials
) -> None:
    grid = read_grid(grid_file(tmp_path, seeds=1))
    for cell in grid.cells:
        (tmp_path / 'cells').mkdir(exist_ok=True)
        (tmp_path / 'cells' / f'{cell_key(cell, materials)}.json').write_text(damage)
    with pytest.raises(ConfigError, match=r'\.json .*: delete the damaged cell'):
        run_sweep(grid, materials, tmp_path, ProgressBars(), scheduler='tcp://nowhere.invalid:1')


def test_an_address_without_a_scheduler_is_named(tmp_path: Path, materials: Materials) -> None:
    grid = read_grid(grid_file(tmp_path, seeds=1))
    with pytest.raises(ConfigError, match='no Dask scheduler at nonsense://x'):
        run_sweep(grid, materials, tmp_path, ProgressBars(), scheduler='nonsense://x')


@pytest.mark.slow
def test_a_killed_worker_and_a_killed_sweep_lose_only_their_current_cells(
    tmp_path: Path, materials: Materials
) -> None:
    grid = read_grid(grid_file(tmp_path, seeds=4))
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address='127.0.0.1:0'
    ) as cluster:
        address = cluster.scheduler_address
        child = multiprocessing.get_context('spawn').Process(
            target=sweep_in_child, args=(grid, materials, tmp_path, address)
        )
        child.start()
        wait_for_cells(tmp_path, 1)
        assert child.pid is not None
        os.kill(child.pid, signal.SIGKILL)
        child.join()
        kept = cell_files(tmp_path)
        assert 0 < len(kept) < len(grid.cells)

        again = multiprocessing.get_context('spawn').Process(
            target=sweep_in_child, args=(grid, materials, tmp_path, address)
        )
        again.start()
        wait_for_cells(tmp_path, len(kept) + 1)
        os.kill(cluster.workers[0].pid, signal.SIGKILL)
        again.join(timeout=PATIENCE_S)
        assert again.exitcode == 0

    assert kept.items() <= cell_files(tmp_path).items(), 'finished cells were run again'
    rows = pyarrow.parquet.read_table(tmp_path / 'results.parquet').to_pylist()
    assert [(row['objects'], row['seed']) for row in rows] == [
        (cell.settings['objects'], cell.seed) for cell in grid.cells
    ]
    assert rows[-1] == run_cell(grid.cells[-1], materials)


def test_only_missing_cells_are_run_and_other_looks_are_other_cells(
    tmp_path: Path, materials: Materials
) -> None:
    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address='127.0.0.1:0'
    ) as cluster:
        address = cluster.scheduler_address
        small = read_grid(grid_file(tmp_path, seeds=1))
        run_sweep(small, materials, tmp_path, ProgressBars(), address)
        written = cell_files(tmp_path)
        assert len(written) == 2

        larger = read_grid(grid_file(tmp_path, seeds=2))
        table = run_sweep(larger, materials, tmp_path, ProgressBars(), address)
        assert written.items() <= cell_files(tmp_path).items()
        assert pyarrow.parquet.read_table(table).num_rows == 4

        other = Materials(materials.fresh, materials.pool, materials.places)
        run_sweep(small, other, tmp_path, ProgressBars(), address)
        assert len(cell_files(tmp_path)) == 4 + 2
    # All cells are there: no scheduler is contacted.
    run_sweep(larger, materials, tmp_path, ProgressBars(), scheduler='tcp://nowhere.invalid:1')


def rows_of_curve(learning_rate: float, start: float, rises_at: int, end: float) -> list[Any]:
    """Return rows of a sweep whose runs rise once, with two seeds and 1 and 10 objects."""
    curve = np.where(np.arange(BLOCKS) < rises_at, start, end)
    return [
        {
            'objects': objects, 'seed': seed, 'pairs': 'all', 'learning_rate': learning_rate,
            'online_end': end + shift, 'online_by_block': (curve + shift).tolist(),
        }
        for objects in (1, 10)
        for seed, shift in ((0, -0.01), (1, 0.01))
    ]  # fmt: skip


def test_the_best_end_is_chosen_among_the_curves_of_the_papers_shape() -> None:
    rows = [
        *rows_of_curve(0.1, start=0.1, rises_at=12, end=0.7),
        *rows_of_curve(0.2, start=0.1, rises_at=12, end=0.8),
        *rows_of_curve(0.3, start=0.3, rises_at=12, end=0.9),  # not at chance with 10 objects
        *rows_of_curve(0.4, start=0.1, rises_at=2, end=0.95),  # it rises within stage I
    ]
    ranked = rank_candidates(rows)
    assert [candidate.settings for candidate in ranked] == [
        {'learning_rate': rate} for rate in (0.2, 0.1, 0.4, 0.3)
    ]
    assert [candidate.has_shape_of_paper for candidate in ranked] == [True, True, False, False]
    assert ranked[0].ends == pytest.approx({1: 0.8, 10: 0.8})
    assert ranked[0].success == pytest.approx(0.8)


@pytest.mark.parametrize('name', READINGS)
def test_the_chosen_and_the_first_values_are_candidates_of_the_shipped_sweep(name: str) -> None:
    grid = read_grid(Path(str(files('ja_experiments.paper') / f'choice_{name}.yaml')))
    candidates = [cell.config().with_settings({'objects': 5}) for cell in grid.cells]
    for values in VALUES:
        assert reading(name, values).with_settings({'objects': 5}) in candidates, values
