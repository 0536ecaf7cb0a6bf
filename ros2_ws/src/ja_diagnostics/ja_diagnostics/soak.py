"""The whole graph for a long time: does anything grow, slow down, or get lost? (`./ja soak`)

Memory and processor time of every node are read from /proc, the rates at which it hears its topics
from /diagnostics: a rate below that of the camera is images lost.
"""

import os
import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context

from ja_common.graph_node import GraphNode
from ja_common.private_executor import own_executor
from ja_common.topics import DIAGNOSTICS
from ja_runner.graph import NodeSpec
from ja_runner.supervisor import Supervisor

COLUMNS = ('what', 'begin', 'end', 'growth an hour', 'unit')
_SAMPLE_EVERY_S = 10.0
# Caches fill, and the learner's memory of trials, before anything is called growth.
_WARM_UP_SHARE = 1 / 3
_MB = 2**20
_TICKS_S = os.sysconf('SC_CLK_TCK')
_PAGE = os.sysconf('SC_PAGE_SIZE')


@dataclass(frozen=True)
class Series:
    """Samples of one figure: times [s] and values, both (N,)."""

    name: str
    unit: str
    times_s: list[float]
    values: list[float]

    def row(self) -> tuple[str, ...]:
        """As shown to people, below `COLUMNS`: means of the warm run's first and last third."""
        times, values = np.array(self.times_s), np.array(self.values)
        warm = times >= times[0] + _WARM_UP_SHARE * (times[-1] - times[0])
        times, values = times[warm], values[warm]
        parts = np.array_split(values, 3)
        growth = 3600.0 * np.polyfit(times, values, 1)[0]
        begin, end = parts[0].mean(), parts[-1].mean()
        return self.name, f'{begin:.1f}', f'{end:.1f}', f'{growth:+.1f}', self.unit


class Rates(GraphNode):
    """The rates at which the nodes hear their topics, by their own report."""

    def __init__(self, context: Context) -> None:
        super().__init__('soak', context=context)
        self.rates: dict[str, float] = {}
        self.subscribe(DIAGNOSTICS, self._on_diagnostics)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            for pair in status.values:
                if pair.key.endswith(' rate [1/s]'):
                    topic = pair.key.removesuffix(' rate [1/s]')
                    self.rates[f'{status.name} hears {topic}'] = float(pair.value)


class Soak:
    """Runs a graph, a process a node, for so long, and samples it."""

    def __init__(self, graph: list[NodeSpec], folder: Path, report: Callable[[str], None]) -> None:
        self._folder = folder
        self._supervisor = Supervisor(graph, folder / 'log', 'stop', report)
        self._samples: dict[tuple[str, str], Series] = {}
        self._busy_s: dict[str, float] = defaultdict(float)
        self._sampled_s = 0.0

    def run(self, seconds: float) -> int:
        """The exit code of the graph; the figures are in `series` afterwards."""
        with own_executor() as executor:
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
        """All figures, by what they are of."""
        return [self._samples[key] for key in sorted(self._samples)]

    def _sample(self, now_s: float, rates: Rates) -> None:
        elapsed_s, self._sampled_s = now_s - self._sampled_s, now_s
        shared: set[str] = set()
        for thing, pid in self._supervisor.pids.items():
            process = Path(f'/proc/{pid}')
            resident = int((process / 'statm').read_text().split()[1]) * _PAGE
            times = (process / 'stat').read_text().rsplit(')', 1)[1].split()
            busy_s = (int(times[11]) + int(times[12])) / _TICKS_S
            self._add(now_s, f'memory of {thing}', 'MB', resident / _MB)
            if self._busy_s[thing]:
                share = 100.0 * (busy_s - self._busy_s[thing]) / elapsed_s
                self._add(now_s, f'processor, {thing}', '%', share)
            self._busy_s[thing] = busy_s
            lines = (process / 'maps').read_text().splitlines()
            shared |= {line.split()[-1] for line in lines if '/dev/shm/' in line}
        self._add(now_s, 'shared memory', 'MB', _size(map(Path, shared)) / _MB)
        self._add(now_s, 'folder of the run', 'MB', _size(self._folder.rglob('*')) / _MB)
        for name, rate in rates.rates.items():
            self._add(now_s, f'rate, {name}', '1/s', rate)

    def _add(self, now_s: float, name: str, unit: str, value: float) -> None:
        series = self._samples.setdefault((unit, name), Series(name, unit, [], []))
        series.times_s.append(now_s)
        series.values.append(value)


def _size(paths: Iterable[Path]) -> int:
    return sum(path.stat().st_size for path in paths if path.is_file())
