"""Many independent runs, side by side in processes."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Any, TypeVar

import torch

from ja_experiments.progress import Progress

Result = TypeVar('Result')


def side_by_side(
    title: str, run: Callable[..., Result], tasks: Iterable[tuple[Any, ...]]
) -> list[Result]:
    """`run(*task)` for every task, in the order of the tasks; a bar on the terminal meanwhile."""
    every = list(tasks)
    spawn = multiprocessing.get_context('spawn')  # forked threads of torch would hang
    with (
        ProcessPoolExecutor(
            os.cpu_count(), spawn, initializer=torch.set_num_threads, initargs=(1,)
        ) as pool,
        Progress().bar(title, len(every)) as advance,
    ):
        futures = [pool.submit(run, *task) for task in every]
        for future in as_completed(futures):
            future.result()  # an error ends the whole
            advance(1)
        return [future.result() for future in futures]
