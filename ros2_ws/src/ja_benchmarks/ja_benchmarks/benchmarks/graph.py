"""The whole graph with the sim: images and trials a second, latency per hop, start-up."""

import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ja_benchmarks.rows import Row, percentile_99, row
from ja_common.core.config import ConfigError
from ja_common.time_codec import to_ns
from ja_common.topics import DETECTIONS, FIXATION, IMAGE, JOINT_COMMANDS, LM_DELTA, VF_DELTA
from ja_runner.graph import sim_graph, with_arguments
from ja_runner.node_spec import NodeSpec
from ja_runner.progress import ProgressNode
from ja_runner.run import run_graph

MEASURE_S = 20.0
WARM_UP_S = 3.0
BLOCK_S = 1.0
# In the order in which the messages of one image are made.
HOPS = (DETECTIONS, VF_DELTA, LM_DELTA, FIXATION, JOINT_COMMANDS)


def run() -> dict[str, Row]:
    """Run in lockstep in both compositions, then in real time for the latencies."""
    rows: dict[str, Row] = {}
    for name, one_process in (('many processes', False), ('one process', True)):
        rates = lockstep_rates(sim_graph(), one_process)
        rows |= {f'{figure}, {name}': row for figure, row in rates.items()}
    return rows | _latencies()


def lockstep_rates(graph: Sequence[NodeSpec], one_process: bool) -> dict[str, Row]:
    """Measure image steps and trials a second of a graph, and the time to its first command.

    Also measure the processor time of this process for an image, which is that of the whole graph
    if the graph runs in one process.
    """
    return _RateMeter(graph, one_process).rates()


class _RateMeter:
    """One lockstep run, with the times at which images and trials were finished."""

    def __init__(self, graph: Sequence[NodeSpec], one_process: bool) -> None:
        self._began_s = time.monotonic()
        self._images: list[tuple[float, float, int, int]] = []
        run_for_benchmark(graph, self._sample, one_process)

    def _sample(self, node: ProgressNode) -> bool:
        if node.images and not self._images:
            self._first_image_s = time.monotonic()
        if node.images:
            self._images.append(
                (time.monotonic(), time.process_time(), node.images, len(node.curve.records))
            )
        return node.elapsed_s > WARM_UP_S + MEASURE_S

    def rates(self) -> dict[str, Row]:
        """Return rates over blocks of time after the warm-up, and the start-up time."""
        times, busy, images, trials = np.array(self._images).T
        warm = times > self._first_image_s + WARM_UP_S
        times, busy, images, trials = times[warm], busy[warm], images[warm], trials[warm]
        # One edge a block; a block's rate is a sample.
        edges = np.searchsorted(times, np.arange(times[0], times[-1], BLOCK_S))
        seconds = np.diff(times[edges])
        return {
            'image steps': row(np.diff(images[edges]) / seconds, 'images/s'),
            'processor time of this process': row(
                1e3 * np.diff(busy[edges]) / np.diff(images[edges]), 'ms/image'
            ),
            'trials': row(np.diff(trials[edges]) / seconds, 'trials/s'),
            'start to first command': {
                'value': self._first_image_s - self._began_s,
                'unit': 's',
                'n': 1,
                'interval': None,
            },
        }


class _DelayMeter:
    """The times at which the messages of each image arrived at one subscriber."""

    def __init__(self) -> None:
        self._arrived_s: dict[int, dict[str, float]] = defaultdict(dict)
        self._subscribed = False

    def tick(self, node: ProgressNode) -> bool:
        """Subscribe at the first call; return True when the measurement is over."""
        if not self._subscribed:
            self._subscribed = True
            for topic in (IMAGE, *HOPS):
                node.subscribe(topic, self._make_callback(topic.name))
        return node.elapsed_s > WARM_UP_S + MEASURE_S

    def _make_callback(self, name: str) -> Callable[[Any], None]:
        def note(message: Any) -> None:
            self._arrived_s[to_ns(message.header.stamp)].setdefault(name, time.monotonic())

        return note

    def rows(self) -> dict[str, Row]:
        """Return the delays from the image to each topic."""
        rows: dict[str, Row] = {}
        rounds = [r for r in self._arrived_s.values() if len(r) == len(HOPS) + 1]
        for topic in HOPS:
            delays_ms = 1e3 * np.array([r[topic.name] - r[IMAGE.name] for r in rounds])
            rows[f'{IMAGE.name} to {topic.name}, median'] = row(delays_ms, 'ms', np.median)
            rows[f'{IMAGE.name} to {topic.name}, 99th percentile'] = row(
                delays_ms, 'ms', percentile_99
            )
        return rows


def _latencies() -> dict[str, Row]:
    stopwatch = _DelayMeter()
    graph = with_arguments(sim_graph(), ['-p', 'lockstep:=false'])
    run_for_benchmark(graph, stopwatch.tick, one_process=False)
    return {f'{name}, 10 Hz, many processes': row for name, row in stopwatch.rows().items()}


def run_for_benchmark(
    graph: Sequence[NodeSpec], done: Callable[[ProgressNode], bool], one_process: bool
) -> None:
    """Run a graph until `done`. Raises ConfigError when it ends before."""
    with TemporaryDirectory() as folder:
        code, _ = run_graph(graph, Path(folder), 'bench graph', done, one_process=one_process)
    if code:
        raise ConfigError('the graph did not run to the end of the measurement')
