"""How fast the paper's experiment runs: the kernel, and a plain PyTorch loop, in one run.

The plain loop is the readable experiment, one image and one optimiser step at a time. It spends
time on more than the network, so the speed of its PyTorch calls alone is given as well: no loop of
single steps can be faster than that. Processor time shows the speed on a machine without other
work.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from scipy.stats import t as student

from ja_benchmarks.rows import Row
from ja_experiments.config import READINGS, reading
from ja_experiments.datasets.looks import load_looks
from ja_experiments.paper.experiment import Materials, Plan, run_conditions
from ja_experiments.paper.reference import ReferenceExperiment
from ja_experiments.paper.study import FEATURED_OBJECTS, OBJECTS, compile_kernel
from ja_sim.core.scene import load_scene

_REPETITIONS = 5
_PLAIN_TRIALS = 1000
_WARM_UP_TRIALS = 100


def run() -> dict[str, Row]:
    """Measure the speed of both, and the time of the whole of Figure 6, for each reading."""
    torch.set_num_threads(1)
    materials = Materials.from_looks(load_looks(), load_scene('default').objects)
    compile_kernel(materials)
    rows: dict[str, Row] = {}
    for name in READINGS:
        rows |= {f'{name}: {figure}': row for figure, row in _speed(name, materials).items()}
    return rows


def _speed(name: str, materials: Materials) -> dict[str, Row]:
    plain, torch_only = _plain_speed(name, materials)
    seconds, processor_seconds, trials = _figure_6(name, materials)
    fast = trials / seconds
    return {
        'plain PyTorch loop': _row(plain, 'trials/s'),
        'the PyTorch calls of it alone': _row(torch_only, 'trials/s'),
        'kernel, all cores': _single(fast, 'trials/s'),
        'Figure 6, whole': _single(seconds, 's'),
        'Figure 6, whole, processor time': _single(processor_seconds, 's'),
        'kernel over plain loop': _row(fast / plain, 'times'),
        'kernel over PyTorch calls': _row(fast / torch_only, 'times'),
    }


def _plain_speed(name: str, materials: Materials) -> tuple[np.ndarray, np.ndarray]:
    """Measure trials/s of the readable experiment and of its PyTorch calls, by repetition."""
    config = reading(name).with_settings({'objects': FEATURED_OBJECTS})
    experiment = ReferenceExperiment(config, materials.places, materials.pool, seed=0)
    network, in_torch = experiment.network, _FunctionTimer()
    network.predict = in_torch.around(network.predict)  # type: ignore[method-assign]
    network.update = in_torch.around(network.update)  # type: ignore[method-assign]
    experiment.run(_WARM_UP_TRIALS)
    plain, torch_only = [], []
    for _ in range(_REPETITIONS):
        in_torch.seconds = 0.0
        start = time.perf_counter()
        experiment.run(_PLAIN_TRIALS)
        plain.append(_PLAIN_TRIALS / (time.perf_counter() - start))
        torch_only.append(_PLAIN_TRIALS / in_torch.seconds)
    return np.array(plain), np.array(torch_only)


def _figure_6(name: str, materials: Materials) -> tuple[float, float, int]:
    """Run all object counts and seeds, with tests; return time, processor time [s], trials."""
    plan = Plan()
    configs = {str(n): reading(name).with_settings({'objects': n}) for n in OBJECTS}
    start, processor_start = time.perf_counter(), time.process_time()
    run_conditions(configs, plan, materials)
    seconds, used = time.perf_counter() - start, time.process_time() - processor_start
    return seconds, used, len(configs) * len(plan.seeds) * plan.trials


class _FunctionTimer:
    """The total time spent in functions."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def around(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function with its time added to `seconds`."""

        def timed(*args: Any) -> Any:
            start = time.perf_counter()
            result = function(*args)
            self.seconds += time.perf_counter() - start
            return result

        return timed


def _single(value: float, unit: str) -> Row:
    return {'value': value, 'unit': unit, 'n': 1, 'interval': None}


def _row(values: np.ndarray, unit: str) -> Row:
    mean = float(values.mean())
    half = float(student.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values)))
    return {'value': mean, 'unit': unit, 'n': len(values), 'interval': [mean - half, mean + half]}
