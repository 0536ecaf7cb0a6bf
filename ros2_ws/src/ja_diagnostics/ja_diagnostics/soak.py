"""Run the whole graph for a long time (`./ja soak`): does anything grow, slow down, or get lost?

psutil measures memory and processor time of every node. /diagnostics gives the rates at which it
receives its topics: a rate below that of the camera means lost images.
"""

import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context

from ja_common.graph_node import GraphNode
from ja_common.private_context import private_executor
from ja_common.topics import DIAGNOSTICS
from ja_runner.node_spec import NodeSpec
from ja_runner.running_nodes import claim_names
from ja_runner.supervisor import Supervisor

COLUMNS = ('what', 'begin', 'end', 'growth an hour', 'unit')
_SAMPLE_EVERY_S = 10.0
# Caches and the learner's memory of trials fill first; that is not counted as growth.
_WARM_UP_SHARE = 1 / 3
_MB = 2**20


@dataclass(frozen=True)
class Series:
    """Samples of one figure: times [s] and values, both (N,)."""

    name: str
    unit: str
    times_s: list[float]
    values: list[float]

    def row(self) -> tuple[str, ...]:
        """Return the row of the table with `COLUMNS`.

        `begin` and `end` are the means over the first and the last third of the warm run.
        """
        times, values = np.array(self.times_s), np.array(self.values)
        warm = times >= times[0] + _WARM_UP_SHARE * (times[-1] - times[0])
        times, values = times[warm], values[warm]
        parts = np.array_split(values, 3)
        growth = 3600.0 * np.polyfit(times, values, 1)[0]
        begin, end = parts[0].mean(), parts[-1].mean()
        return self.name, f'{begin:.1f}', f'{end:.1f}', f'{growth:+.1f}', self.unit


class Rates(GraphNode):
    """A node that collects the rates [1/s] at which the nodes report to receive their topics."""

    def __init__(self, context: Context) -> None:
        super().__init__('soak', context=context)
        self.rates: dict[str, float] = {}
        self.subscribe(DIAGNOSTICS, self._on_diagnostics)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            for pair in status.values:
                if pair.key.endswith(' rate [1/s]'):
                    topic = pair.key.removesuffix(' rate [1/s]')
                    self.rates[f'{status.name} receives {topic}'] = float(pair.value)


class Soak:
    """A graph with one process for each node, and samples of its use of the machine."""

    def __init__(self, graph: list[NodeSpec], folder: Path, report: Callable[[str], None]) -> None:
        self._graph = graph
        self._folder = folder
        self._supervisor = Supervisor(graph, folder / 'log', report=report)
        self._samples: dict[tuple[str, str], Series] = {}
        self._busy_s: dict[str, float] = defaultdict(float)
        self._sampled_s = 0.0

    def run(self, seconds: float) -> int:
        """Run the graph for so many seconds and sample it; return the exit code of the graph."""
        with claim_names(self._graph), private_executor() as executor:
            rates = Rates(executor.context)
            executor.add_node(rates)
            end_s = time.monotonic() + seconds

            def tick() -> bool:
                executor.spin_once(timeout_sec=0.1)
                now_s = time.monotonic()
                if now_s - self._sampled_s >= _SAMPLE_EVERY_S:
                    self._sample(now_s, rates)
                return now_s >= end_s

            return self._supervisor.run(tick)

    def series(self) -> list[Series]:
        """Return all figures, sorted by unit and name."""
        return [self._samples[key] for key in sorted(self._samples)]

    def _sample(self, now_s: float, rates: Rates) -> None:
        elapsed_s, self._sampled_s = now_s - self._sampled_s, now_s
        shared: set[str] = set()
        for name, pid in self._supervisor.pids.items():
            process = psutil.Process(pid)
            times = process.cpu_times()
            busy_s = times.user + times.system
            self._add_sample(now_s, f'memory of {name}', 'MB', process.memory_info().rss / _MB)
            if self._busy_s[name]:
                share = 100.0 * (busy_s - self._busy_s[name]) / elapsed_s
                self._add_sample(now_s, f'processor, {name}', '%', share)
            self._busy_s[name] = busy_s
            with suppress(psutil.Error):  # it has just died; the supervisor reports it next
                paths = (mapped.path for mapped in process.memory_maps())
                shared |= {path for path in paths if path.startswith('/dev/shm/')}
        self._add_sample(now_s, 'shared memory', 'MB', _size(map(Path, shared)) / _MB)
        self._add_sample(now_s, 'folder of the run', 'MB', _size(self._folder.rglob('*')) / _MB)
        for name, rate in rates.rates.items():
            self._add_sample(now_s, f'rate, {name}', '1/s', rate)

    def _add_sample(self, now_s: float, name: str, unit: str, value: float) -> None:
        series = self._samples.setdefault((unit, name), Series(name, unit, [], []))
        series.times_s.append(now_s)
        series.values.append(value)


def _size(paths: Iterable[Path]) -> int:
    return sum(path.stat().st_size for path in paths if path.is_file())
