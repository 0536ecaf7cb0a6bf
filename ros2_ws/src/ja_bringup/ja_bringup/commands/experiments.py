"""The commands `figures`, `sweep` and `score-learner`, for `./ja`."""

from __future__ import annotations

import os
import tempfile
from enum import Enum
from pathlib import Path
from typing import Annotated, Optional

import typer

_CORES = os.cpu_count() or 1


class PaperValues(str, Enum):
    """The values of the `VALUES` of the experiment."""

    first = 'first'
    chosen = 'chosen'


def register(app: typer.Typer) -> None:
    """Add the commands to an app."""
    app.command()(figures)
    app.command()(sweep)
    app.command('score-learner')(score_learner)


def figures(
    trials: Annotated[
        int,
        typer.Option(
            min=3000, help='Trials of each run; the schedule of the gate is scaled with it.'
        ),
    ] = 300_000,
    seeds: Annotated[int, typer.Option(min=1, help='Runs of each condition.')] = 10,
    first_seed: Annotated[int, typer.Option(min=0, help='Seed of the first run.')] = 0,
    values: Annotated[
        PaperValues,
        typer.Option(
            help='Numbers that the paper does not give: the first tried, or chosen by a sweep.'
        ),
    ] = PaperValues.first,
    ablations: Annotated[int, typer.Option(min=0, help='Seeds of the ablations; 0: none.')] = 0,
    scene: Annotated[str, typer.Option(help='Scene of the sim, by name or file.')] = 'default',
    looks_seed: Annotated[int, typer.Option(min=0, help='Seed of the caregiver.')] = 0,
    data: Annotated[
        Optional[Path],
        typer.Option(help='Folder of `./ja export`: recorded looks in place of rendered ones.'),
    ] = None,
    pool: Annotated[
        int,
        typer.Option(min=0, help='Recorded looks to learn from; 0: 125, or four fifths of them.'),
    ] = 0,
    workers: Annotated[int, typer.Option(min=1, help='Cores to use.')] = _CORES,
    output: Annotated[Optional[Path], typer.Option(help='Folder of the report.')] = None,
) -> None:
    """Reproduce Figures 6 and 7 of the paper, without ROS, and write a report."""
    from ja_common.core.files import SaveError, check_writable
    from ja_common.core.run_folder import new_run_folder
    from ja_experiments.paper.experiment import Plan
    from ja_experiments.paper.report import write_report
    from ja_experiments.paper.study import StudyConfig, run_study
    from ja_experiments.progress_bars import ProgressBars

    config = StudyConfig(
        plan=Plan(trials=trials, seeds=tuple(range(first_seed, first_seed + seeds))),
        values=values.value,
        scene=scene,
        looks_seed=looks_seed,
        data=str(data or ''),
        pool=pool,
        ablation_seeds=min(ablations, seeds),
        workers=workers,
    )
    folder = output or new_run_folder('figures')
    check_writable(folder)  # now, and not after hours
    study = run_study(config, ProgressBars())
    try:
        report = write_report(study, folder)
    except SaveError as error:
        rescued = write_report(study, Path(tempfile.mkdtemp(prefix='joint-attention-figures-')))
        raise SaveError(f'{error}; until then the report is {rescued}') from None
    typer.echo(f'The report: {report}')


def sweep(
    config: Annotated[Path, typer.Argument(help='The grid, as YAML.')],
    scheduler: Annotated[
        Optional[str],
        typer.Option(help='Address of a Dask scheduler; without it, local processes.'),
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help='Local processes.')] = _CORES,
    output: Annotated[
        Optional[Path],
        typer.Option(help='Folder of the results; a run in a folder with results resumes.'),
    ] = None,
) -> None:
    """Run a grid of experiments over seeds and parameters; finished runs are not repeated."""
    from ja_common.core.files import check_writable
    from ja_experiments.paper.study import prepare_materials
    from ja_experiments.progress_bars import ProgressBars
    from ja_experiments.sweep import run_sweep
    from ja_experiments.sweep_grid import read_grid

    folder = output or Path('runs') / f'sweep-{config.stem}'
    grid, progress = read_grid(config), ProgressBars()
    check_writable(folder)
    materials = prepare_materials(grid.scene, grid.looks_seed, progress)
    table = run_sweep(grid, materials, folder, progress, scheduler, workers)
    typer.echo(f'The results: {table}')


def _baseline_names() -> list[str]:
    from ja_experiments.learning_tasks.baselines import BASELINES

    return list(BASELINES)


def _task_names() -> list[str]:
    from ja_experiments.learning_tasks.task_table import TASKS

    return list(TASKS)


def score_learner(
    learners: Annotated[
        Optional[list[str]],
        typer.Argument(
            help='MODULE:CLASS, or names of baselines; all of these but ppo without it.',
            autocompletion=_baseline_names,
        ),
    ] = None,
    task: Annotated[
        Optional[list[str]],
        typer.Option(
            help='One of the tasks, may be repeated; all without it.', autocompletion=_task_names
        ),
    ] = None,
    seeds: Annotated[
        str, typer.Option(help='Seeds of caregiver and learner: 0-3,7. Default: for reports.')
    ] = '10-14',
    output: Annotated[Optional[Path], typer.Option(help='Folder of the scores.')] = None,
) -> None:
    """Score learners in the tasks of the benchmark, each alone on looks it never learned from."""
    from rich.console import Console

    from ja_common.core.files import check_writable
    from ja_common.core.run_folder import new_run_folder
    from ja_experiments.learning_tasks.baselines import find_entrant
    from ja_experiments.learning_tasks.score_report import (
        QUICK_BASELINES,
        read_seeds,
        score_all,
        score_tables,
        write_scores,
    )
    from ja_experiments.learning_tasks.task_table import TASKS, find_task

    names, numbers = learners or list(QUICK_BASELINES), read_seeds(seeds)
    tasks = [find_task(name).name for name in task or TASKS]
    for name in names:
        find_entrant(name)  # what cannot enter is found now, and not after minutes
    folder = output or new_run_folder('scores')
    check_writable(folder)
    rows = score_all(names, tasks, numbers)
    for table in score_tables(rows):
        Console().print(table)
    write_scores(rows, numbers, folder)
    typer.echo(f'The scores: {folder}')
