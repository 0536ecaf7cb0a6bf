"""Every node in its own process: start, watch, restart or stop, end cleanly."""

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Literal

from ja_runner.child import PARENT
from ja_runner.dead_segments import remove_dead_segments
from ja_runner.graph import NodeSpec

OnDeath = Literal['stop', 'restart']

# A node that dies this soon after its start did not recover by being started.
_SHORT_LIFE_S = 5.0
_SHORT_LIVES = 3
_TAIL_LINES = 8
_WORTH_SHOWING = ('[ERROR]', '[FATAL]')  # warnings reach the display through /diagnostics


@dataclass(frozen=True)
class Death:
    """A node that ended although nobody asked it to."""

    node: str
    returncode: int
    last_lines: str

    def __str__(self) -> str:
        if self.returncode < 0:
            how = f'was killed by {signal.Signals(-self.returncode).name}'
        else:
            how = f'ended with exit code {self.returncode}'
        said = f'; its last lines:\n{self.last_lines}' if self.last_lines else ''
        return f'{self.node} {how}{said}'


@contextmanager
def _blocked(number: signal.Signals) -> Iterator[None]:
    """Hold a signal back; children that are started meanwhile inherit that (see `child`)."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {number})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class NodeProcess:
    """One node's process and its log; the log is a file, so nothing blocks when we are slow."""

    def __init__(self, spec: NodeSpec, log: Path) -> None:
        self.spec = spec
        self._log = log
        self._shown_to = 0
        self._short_lives = 0
        self.start()

    def start(self) -> None:
        self.began_s = time.monotonic()
        environ = {
            **os.environ,
            # Python would keep lines back that a dying node has printed.
            'PYTHONUNBUFFERED': '1',
            **self.spec.environ,
            PARENT: str(os.getpid()),
        }
        with self._log.open('ab') as log, _blocked(signal.SIGINT):
            self._starts_at = log.tell()
            # A session of its own: Ctrl-C reaches the supervisor alone, which ends all in order.
            self.popen = subprocess.Popen(
                self.spec.command(),
                env=environ,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def keeps_dying(self) -> bool:
        """Count this death; whether there were too many early ones in a row."""
        short = time.monotonic() - self.began_s < _SHORT_LIFE_S
        self._short_lives = self._short_lives + 1 if short else 0
        return self._short_lives >= _SHORT_LIVES

    def signal(self, number: int) -> None:
        if self.popen.poll() is None:
            self.popen.send_signal(number)

    def last_lines(self) -> str:
        lines = self._read(self._starts_at).decode(errors='replace').splitlines()
        return '\n'.join(f'  {line}' for line in lines[-_TAIL_LINES:])

    def news(self) -> list[str]:
        """Errors that the node has logged since the last call."""
        written = self._read(self._shown_to)
        complete = written[: written.rfind(b'\n') + 1]
        self._shown_to += len(complete)
        lines = complete.decode(errors='replace').splitlines()
        return [line for line in lines if line.startswith(_WORTH_SHOWING)]

    def _read(self, start: int) -> bytes:
        with self._log.open('rb') as log:
            log.seek(start)
            return log.read()


class Supervisor:
    """Runs a graph until it is done, asked to stop, or broken.

    `report` gets one line for people each time something happens. Logs go to `log_folder`, one
    file a node.
    """

    def __init__(
        self,
        graph: Sequence[NodeSpec],
        log_folder: Path,
        on_death: OnDeath = 'stop',
        report: Callable[[str], None] = print,
        patience_s: float = 5.0,
    ) -> None:
        self._graph = graph
        self._log_folder = log_folder
        self._on_death = on_death
        self._report = report
        self._patience_s = patience_s
        self._processes: list[NodeProcess] = []
        self._asked_to_stop = 0

    @property
    def pids(self) -> dict[str, int]:
        """Process ids by node, for tools and tests."""
        return {process.spec.thing: process.popen.pid for process in self._processes}

    def run(self, tick: Callable[[], bool]) -> int:
        """Start all and call `tick` (which may wait a little) until it returns True.

        Returns the exit code: 0 when done or asked to stop, 1 when a node died and could not be
        replaced.
        """
        before = {
            number: signal.signal(number, self._stop_later)
            for number in (signal.SIGINT, signal.SIGTERM)
        }
        try:
            self._start()
            while not (self._asked_to_stop or tick()):
                if not self._all_alive():
                    return 1
            return 0
        finally:
            self._stop()
            for number, handler in before.items():
                signal.signal(number, handler)

    def _stop_later(self, _number: int, _frame: FrameType | None) -> None:
        self._asked_to_stop += 1

    def _start(self) -> None:
        self._log_folder.mkdir(parents=True, exist_ok=True)
        remove_dead_segments()
        for spec in self._graph:
            self._processes.append(NodeProcess(spec, self._log_folder / f'{spec.thing}.log'))

    def _all_alive(self) -> bool:
        """Report what the nodes complain about; deal with the dead. False: the graph is broken."""
        for process in self._processes:
            for line in process.news():
                self._report(line)
            returncode = process.popen.poll()
            if returncode is None or self._asked_to_stop:
                continue
            death = Death(process.spec.thing, returncode, process.last_lines())
            if self._on_death == 'stop':
                self._report(f'{death}\nstopping the rest')
                return False
            if process.keeps_dying():
                self._report(f'{death}\nit has died {_SHORT_LIVES} times at once; stopping')
                return False
            self._report(f'{death}\nstarting it again')
            remove_dead_segments()  # or a node that dies again and again fills the memory
            process.start()
        return True

    def _stop(self) -> None:
        """SIGINT, then SIGTERM, then SIGKILL; a second Ctrl-C goes on to the next at once."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            for process in self._processes:
                process.signal(number)
            if self._wait():
                return
            alive = [p.spec.thing for p in self._processes if p.popen.poll() is None]
            self._report(f'{", ".join(alive)} did not end on {signal.Signals(number).name}')

    def _wait(self) -> bool:
        """Whether all have ended in time."""
        end = time.monotonic() + self._patience_s
        asked = self._asked_to_stop
        while any(process.popen.poll() is None for process in self._processes):
            if time.monotonic() > end or self._asked_to_stop > asked:
                return False
            time.sleep(0.01)
        return True
