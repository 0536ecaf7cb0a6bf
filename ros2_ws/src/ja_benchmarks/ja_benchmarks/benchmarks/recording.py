"""The cost of a recorder, and the share that it records: lockstep runs with and without it."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ja_benchmarks.rows import Row, row
from ja_common.core.config import ConfigError
from ja_common.topics import GATE_STATUS
from ja_recording.core.reader import Recording
from ja_runner.graph import RECORDER, sim_graph
from ja_runner.progress import ProgressNode
from ja_runner.run import run_graph

REPEATS = 5
MEASURE_S = 10.0
WARM_UP_S = 3.0


def run() -> dict[str, Row]:
    """Alternate runs with and without it, so that a machine that slows down slows both."""
    rates: dict[bool, list[float]] = {False: [], True: []}
    shares: list[float] = []
    for _ in range(REPEATS):
        for recorded in (False, True):
            rate, share = _measure(recorded)
            rates[recorded].append(rate)
            shares += share
    ratios = np.divide(rates[True], rates[False])
    return {
        'image steps, not recorded': row(rates[False], 'images/s'),
        'image steps, recorded': row(rates[True], 'images/s'),
        'recorded to not recorded': row(ratios, 'ratio'),
        'answered images that were recorded': row(shares, 'share'),
    }


def _measure(recorded: bool) -> tuple[float, list[float]]:
    warm: list[tuple[int, float]] = []

    def done(node: ProgressNode) -> bool:
        if node.elapsed_s > WARM_UP_S and not warm:
            warm.append((node.images, node.elapsed_s))
        return node.elapsed_s > WARM_UP_S + MEASURE_S

    with TemporaryDirectory() as folder:
        target = Path(folder) / 'recording'
        recorder = replace(RECORDER, parameters={'folder': str(target)})
        graph = [*[recorder] * recorded, *sim_graph()]
        code, watcher = run_graph(graph, Path(folder), 'bench recording', done)
        if code or not warm:
            raise ConfigError('the graph did not run to the end of the measurement')
        images, seconds = watcher.images - warm[0][0], watcher.elapsed_s - warm[0][1]
        return images / seconds, [_recorded_share(target, watcher.images)] if recorded else []


def _recorded_share(folder: Path, answered: int) -> float:
    """Return the share of the images answered by the gate whose answer is in the recording."""
    answers = Recording(folder).messages({f'/{GATE_STATUS.name}'})
    return sum(1 for _ in answers) / answered
