"""Supervision of nodes in their own processes: start, watch, restart, stop."""

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
from ja_runner.node_spec import NodeSpec

OnDeath = Literal['stop', 'restart']

# A node that dies this soon after its start did not recover by the restart.
_EARLY_DEATH_S = 5.0
_MAX_EARLY_DEATHS = 3
_TAIL_LINES = 8
_SHOWN_LEVELS = ('[ERROR]', '[FATAL]')  # warnings reach the display through /diagnostics


@dataclass(frozen=True)
class Death:
    """A node that ended without being asked to."""

    node: str
    returncode: int
    last_lines: str

    def __str__(self) -> str:
        if self.returncode < 0:
            how = f'was killed by {signal.Signals(-self.returncode).name}'
        else:
            how = f'ended with exit code {self.returncode}'
        tail = f'; its last lines:\n{self.last_lines}' if self.last_lines else ''
        return f'{self.node} {how}{tail}'


@contextmanager
def _signal_blocked(number: signal.Signals) -> Iterator[None]:
    """Block a signal; child processes started meanwhile inherit the block (see `child`)."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {number})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class NodeProcess:
    """One node's process and its log file; a file, so that a slow reader never blocks the node."""

    def __init__(self, spec: NodeSpec, log: Path) -> None:
        self.spec = spec
        self._log = log
        self._read_up_to = 0
        self._early_deaths = 0
        self.start()

    def start(self) -> None:
        """Start the process, or a new one in place of one that ended."""
        self.began_s = time.monotonic()
        environ = {
            **os.environ,
            # Otherwise Python buffers, and loses, the last lines of a node that dies.
            'PYTHONUNBUFFERED': '1',
            **self.spec.environ,
            PARENT: str(os.getpid()),
        }
        with self._log.open('ab') as log, _signal_blocked(signal.SIGINT):
            self._starts_at = os.fstat(log.fileno()).st_size
            # A session of its own: Ctrl-C reaches only the supervisor, which stops all in order.
            self.popen = subprocess.Popen(
                self.spec.command(),
                env=environ,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def count_death(self) -> bool:
        """Count a death; return True if too many early deaths came in a row."""
        early = time.monotonic() - self.began_s < _EARLY_DEATH_S
        self._early_deaths = self._early_deaths + 1 if early else 0
        return self._early_deaths >= _MAX_EARLY_DEATHS

    def send_signal(self, number: int) -> None:
        """Send a signal, unless the process has ended."""
        if self.popen.poll() is None:
            self.popen.send_signal(number)

    def last_lines(self) -> str:
        """Return the last lines of the log since the last start, indented."""
        lines = self._read(self._starts_at).decode(errors='replace').splitlines()
        return '\n'.join(f'  {line}' for line in lines[-_TAIL_LINES:])

    def new_errors(self) -> list[str]:
        """Return the errors that the node has logged since the last call."""
        written = self._read(self._read_up_to)
        complete = written[: written.rfind(b'\n') + 1]
        self._read_up_to += len(complete)
        lines = complete.decode(errors='replace').splitlines()
        return [line for line in lines if line.startswith(_SHOWN_LEVELS)]

    def _read(self, start: int) -> bytes:
        with self._log.open('rb') as log:
            log.seek(start)
            return log.read()


class Supervisor:
    """Runs a graph until it is done, asked to stop, or broken.

    `report` gets one readable line for each event. Logs go to `log_folder`, one file a node.
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
        self._stop_requests = 0

    @property
    def pids(self) -> dict[str, int]:
        """Return the process id of each node, by its executable."""
        return {process.spec.executable: process.popen.pid for process in self._processes}

    def run(self, tick: Callable[[], bool]) -> int:
        """Start all nodes and call `tick` (which may wait a little) until it returns True.

        Returns the exit code: 0 when done or asked to stop, 1 when a node died and could not be
        replaced.
        """
        before = {
            number: signal.signal(number, self._on_stop_signal)
            for number in (signal.SIGINT, signal.SIGTERM)
        }
        try:
            self._start()
            while not (self._stop_requests or tick()):
                if not self._check_processes():
                    return 1
            return 0
        finally:
            self._stop()
            for number, handler in before.items():
                signal.signal(number, handler)

    def _on_stop_signal(self, _number: int, _frame: FrameType | None) -> None:
        self._stop_requests += 1

    def _start(self) -> None:
        self._log_folder.mkdir(parents=True, exist_ok=True)
        remove_dead_segments()
        for spec in self._graph:
            self._processes.append(NodeProcess(spec, self._log_folder / f'{spec.executable}.log'))

    def _check_processes(self) -> bool:
        """Report errors and deaths, restart dead nodes; return False if the graph is broken."""
        for process in self._processes:
            for line in process.new_errors():
                self._report(line)
            returncode = process.popen.poll()
            if returncode is None or self._stop_requests:
                continue
            death = Death(process.spec.executable, returncode, process.last_lines())
            if self._on_death == 'stop':
                self._report(f'{death}\nstopping the rest')
                return False
            if process.count_death():
                self._report(f'{death}\nit has died {_MAX_EARLY_DEATHS} times at once; stopping')
                return False
            self._report(f'{death}\nrestarting it')
            remove_dead_segments()  # a node that dies repeatedly would fill the memory
            process.start()
        return True

    def _stop(self) -> None:
        """Send SIGINT, then SIGTERM, then SIGKILL; a second Ctrl-C skips the wait between them."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            for process in self._processes:
                process.send_signal(number)
            if self._wait():
                return
            running = [p.spec.executable for p in self._processes if p.popen.poll() is None]
            self._report(f'{", ".join(running)} did not end on {signal.Signals(number).name}')

    def _wait(self) -> bool:
        """Wait until all have ended; return False if they do not end in time."""
        end = time.monotonic() + self._patience_s
        requests = self._stop_requests
        while any(process.popen.poll() is None for process in self._processes):
            if time.monotonic() > end or self._stop_requests > requests:
                return False
            time.sleep(0.01)
        return True
