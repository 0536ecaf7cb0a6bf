"""Run many independent tasks in parallel processes."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Any, TypeVar

import torch

from ja_experiments.progress_bars import ProgressBars

Result = TypeVar('Result')


def run_in_processes(
    title: str, run: Callable[..., Result], tasks: Iterable[tuple[Any, ...]]
) -> list[Result]:
    """Return `run(*task)` of every task, in their order; show a progress bar meanwhile."""
    every = list(tasks)
    spawn = multiprocessing.get_context('spawn')  # forked threads of torch would hang
    with (
        ProcessPoolExecutor(
            os.cpu_count(), spawn, initializer=torch.set_num_threads, initargs=(1,)
        ) as pool,
        ProgressBars().bar(title, len(every)) as advance,
    ):
        futures = [pool.submit(run, *task) for task in every]
        for future in as_completed(futures):
            future.result()  # an error in one task ends all of them
            advance(1)
        return [future.result() for future in futures]
