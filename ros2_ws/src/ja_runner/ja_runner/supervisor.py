"""Supervision of nodes in their own processes: start, watch, replace, stop."""

import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ja_common.stop_signals import StopSignals
from ja_runner.dead_segments import remove_dead_segments
from ja_runner.node_process import Death, NodeProcess
from ja_runner.node_spec import NodeSpec

OnDeath = Literal['stop', 'restart']

# A node that dies this soon after its start did not recover by the restart.
_EARLY_DEATH_S = 5.0
_MAX_EARLY_DEATHS = 3


@dataclass(frozen=True)
class Supervision:
    """How a graph is supervised.

    `on_death`: what to do when a node has died. `hung_after_s`: a node without a heartbeat for so
    long is killed, and has died. `patience_s`: so long a node may take to end after a signal,
    before the next, harder one.
    """

    on_death: OnDeath = 'stop'
    hung_after_s: float = 10.0
    patience_s: float = 5.0


DEFAULT = Supervision()


class Supervisor:
    """Runs a graph until it is done, asked to stop, or broken.

    `report` gets one readable line for each event. Logs go to `log_folder`, one file a node.
    """

    def __init__(
        self,
        graph: Sequence[NodeSpec],
        log_folder: Path,
        supervision: Supervision = DEFAULT,
        report: Callable[[str], None] = print,
    ) -> None:
        self._graph = graph
        self._log_folder = log_folder
        self._supervision = supervision
        self._report = report
        self._processes: list[NodeProcess] = []
        self._early_deaths: dict[NodeProcess, int] = {}

    @property
    def pids(self) -> dict[str, int]:
        """Return the process id of each node, by its executable."""
        return {process.spec.executable: process.popen.pid for process in self._processes}

    def run(self, tick: Callable[[], bool]) -> int:
        """Start all nodes and call `tick` (which may wait a little) until it returns True.

        Returns the exit code: 0 when done or asked to stop, 1 when a node died or hung and could
        not be replaced.
        """
        # Further signals are counted, not obeyed: the nodes are still to be ended.
        with StopSignals(on_further=_go_on) as stop:
            try:
                self._start()
                while not (stop.requested or tick()):
                    if not self._check_processes(stop):
                        return 1
                return 0
            finally:
                self._stop(stop)

    def _start(self) -> None:
        self._log_folder.mkdir(parents=True, exist_ok=True)
        remove_dead_segments()
        for spec in self._graph:
            self._processes.append(NodeProcess(spec, self._log_folder / f'{spec.executable}.log'))

    def _check_processes(self, stop: StopSignals) -> bool:
        """Report errors and deaths, replace dead nodes; return False if the graph is broken."""
        for process in self._processes:
            for line in process.new_errors():
                self._report(line)
            if stop.requested:
                continue
            event = self._death(process)
            if event and not self._replace(process, event):
                return False
        return True

    def _death(self, process: NodeProcess) -> str:
        """Return what there is to report of a node that has died, or is hung; it is then dead."""
        returncode = process.popen.poll()
        if returncode is not None:
            return str(Death(process.spec.executable, returncode, process.last_lines()))
        silent_s = process.hung_s(self._supervision.hung_after_s)
        if not silent_s:
            return ''
        lines = process.kill_with_stack()
        return (
            f'{process.spec.executable} was hung, without a heartbeat for {silent_s:.0f} s, and '
            f'was killed; its stack, if it could still write it, is in {process.log}:\n{lines}'
        )

    def _replace(self, process: NodeProcess, event: str) -> bool:
        """Report a death and start the node anew; return False if that is not to be."""
        if self._supervision.on_death == 'stop':
            self._report(f'{event}\nstopping the rest')
            return False
        early = time.monotonic() - process.began_s < _EARLY_DEATH_S
        deaths = self._early_deaths[process] = (
            self._early_deaths.get(process, 0) + 1 if early else 0
        )
        if deaths >= _MAX_EARLY_DEATHS:
            self._report(f'{event}\nit has died {_MAX_EARLY_DEATHS} times at once; stopping')
            return False
        self._report(f'{event}\nrestarting it')
        remove_dead_segments()  # a node that dies repeatedly would fill the memory
        process.start()
        return True

    def _stop(self, stop: StopSignals) -> None:
        """Send SIGINT, then SIGTERM, then SIGKILL; a second Ctrl-C skips the wait between them."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            for process in self._processes:
                process.send_signal(number)
            if self._wait(stop):
                break
            running = [p.spec.executable for p in self._processes if p.popen.poll() is None]
            self._report(f'{", ".join(running)} did not end on {signal.Signals(number).name}')
        for process in self._processes:
            for line in process.new_errors():  # such as a checkpoint that could not be written
                self._report(line)
            process.close()

    def _wait(self, stop: StopSignals) -> bool:
        """Wait until all have ended; return False if they do not end in time."""
        end = time.monotonic() + self._supervision.patience_s
        requests = stop.count
        while any(process.popen.poll() is None for process in self._processes):
            if time.monotonic() > end or stop.count > requests:
                return False
            time.sleep(0.01)
        return True


def _go_on(_number: int) -> None:
    pass
