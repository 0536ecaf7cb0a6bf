"""The progress display: a node that subscribes to the graph, and a table on the terminal."""

import math
import time
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from ja_common.core.learning_curve import LearningCurve
from ja_common.graph_node import GraphNode
from ja_common.status_values import status_values
from ja_common.time_codec import to_ns
from ja_common.topics import DIAGNOSTICS, EVERY_SCORE, FIXATION, GATE_STATUS, TRACK, WEIGHT_FILES
from ja_common.weight_files_codec import decode_weight_files

WINDOW_TRIALS = 100
_SCREEN_EVERY_S = 0.25
_LINE_EVERY_S = 5.0


class ProgressNode(GraphNode):
    """A node that collects the success curve, the gate's state, the image rate, and warnings."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('progress', **node_kwargs)
        self.curve = LearningCurve()
        self.gate: Mapping[str, str] = {}
        self.warnings: dict[str, str] = {}
        self.images = 0
        self.objects = 1
        self.track = ''
        self.weight_files: Mapping[str, str] = {}
        self.began_s = math.nan
        self._image_times_s: deque[float] = deque(maxlen=200)
        self._newest_ns = -1
        self.subscribe(GATE_STATUS, self._on_gate_status)
        self.subscribe(FIXATION, self._on_image)
        self.subscribe(EVERY_SCORE, self._on_score)
        self.subscribe(DIAGNOSTICS, self._on_diagnostics)
        self.subscribe(TRACK, self._on_track)
        self.subscribe(WEIGHT_FILES, self._on_weight_files)

    @property
    def elapsed_s(self) -> float:
        """Return the wall time [s] since the gate's first status; 0 before."""
        return 0.0 if math.isnan(self.began_s) else time.monotonic() - self.began_s

    @property
    def images_per_s(self) -> float:
        """Return the recent rate of images [1/s] that the graph has processed."""
        times = self._image_times_s
        if len(times) < 2 or time.monotonic() - times[-1] > 2.0:
            return 0.0
        return (len(times) - 1) / max(times[-1] - times[0], 1e-9)

    def _on_gate_status(self, message: DiagnosticStatus) -> None:
        if math.isnan(self.began_s):
            self.began_s = time.monotonic()
        self.gate = status_values(message)

    def _on_image(self, message: JointState) -> None:
        """Count an image: each has one message here, with its stamp; the gate has more."""
        stamp_ns = to_ns(message.header.stamp)
        if stamp_ns == self._newest_ns:
            return  # the sim sends an image again whose answer was lost
        self._newest_ns = stamp_ns
        self.images += 1
        self._image_times_s.append(time.monotonic())

    def _on_score(self, message: DiagnosticStatus) -> None:
        values = status_values(message)
        success = values.get('last') == 'success'
        self.objects = int(values.get('objects', '1'))
        self.curve.record_trial(success, float(self.gate.get('p_lm', 'nan')), self.elapsed_s)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.level == DiagnosticStatus.OK:
                self.warnings.pop(status.name, None)
            else:
                self.warnings[status.name] = status.message

    def _on_track(self, message: String) -> None:
        self.track = message.data

    def _on_weight_files(self, message: DiagnosticStatus) -> None:
        self.weight_files = decode_weight_files(message)

    def facts(self) -> dict[str, str]:
        """Return what the display shows, in this order."""
        facts = {
            'trials': str(len(self.curve.records) or self.gate.get('trials', '0')),
            'stage': self.curve.stage or '-',
            'track': self.track or '-',
            'success rate, recent': str(self.curve.rate(slice(-WINDOW_TRIALS, None))),
            'phase': self.gate.get('phase', 'waiting for the first image'),
            'source': self.gate.get('source', '-'),
            'p(LM)': self.gate.get('p_lm', '-'),
            'images/s': f'{self.images_per_s:.0f}',
            'time': f'{self.elapsed_s:.0f} s',
        }
        return facts | dict(sorted(self.warnings.items()))


class Display:
    """A live table on a terminal; elsewhere a plain line every few seconds."""

    def __init__(self, title: str, console: Console | None = None) -> None:
        self._title = title
        self._console = console or Console()
        self._next_s = 0.0
        self._live: Live | None = None
        self.reader_has_gone = False
        """Whether the pipe that the output goes to was closed at its other end."""

    def __enter__(self) -> 'Display':
        if self._console.is_terminal:
            self._live = Live(console=self._console, auto_refresh=False, transient=True)
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            with self._outlive_the_output():
                self._live.stop()

    def print_line(self, text: str) -> None:
        """Print a line that stays above the live table."""
        with self._outlive_the_output():
            if self._live is None:
                print(text, file=self._console.file, flush=True)
            else:
                self._console.print(text, markup=False, highlight=False, soft_wrap=True)

    def update(self, node: ProgressNode) -> None:
        """Show the state of the run, if the last update is old enough."""
        now = time.monotonic()
        if now < self._next_s:
            return
        facts = node.facts()
        if self._live is None:
            self._next_s = now + _LINE_EVERY_S
            self.print_line('  '.join(f'{name}: {text}' for name, text in facts.items()))
            return
        self._next_s = now + _SCREEN_EVERY_S
        table = Table(title=self._title, show_header=False, title_justify='left')
        for name, text in facts.items():
            table.add_row(Text(name), Text(text))  # not markup: a node may write [/anything]
        with self._outlive_the_output():
            self._live.update(table, refresh=True)

    @contextmanager
    def _outlive_the_output(self) -> Iterator[None]:
        """Go on without a line that cannot be written: the run is worth more than its lines."""
        try:
            yield
        except BrokenPipeError:
            self.reader_has_gone = True
        except OSError:
            pass  # its disk is full, or its terminal has ended
