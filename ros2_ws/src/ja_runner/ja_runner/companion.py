"""A node beside the graph, in its own process; its death is reported, and the graph runs on."""

import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

from ja_runner.node_process import Death, NodeProcess
from ja_runner.node_spec import NodeSpec

_PATIENCE_S = 3.0


class Companion:
    """A context manager that runs the node; call `report_events` regularly.

    `report` receives the first line of the log that begins with `announcement` (empty: none), and
    a sentence when the node dies.
    """

    def __init__(
        self, spec: NodeSpec, log_folder: Path, report: Callable[[str], None], announcement: str
    ) -> None:
        log_folder.mkdir(parents=True, exist_ok=True)
        self._spec = spec
        self._log = log_folder / f'{spec.executable}.log'
        self._report = report
        self._announcement = announcement
        self._alive = True

    def __enter__(self) -> 'Companion':
        self._process = NodeProcess(self._spec, self._log)
        return self

    def report_events(self) -> None:
        """Report the announcement and the death of the node, each once, when it has happened."""
        if self._announcement:
            for line in self._log_lines():
                if line.startswith(self._announcement) and line.endswith('\n'):
                    self._announcement = ''
                    self._report(line.strip())
                    break
        returncode = self._process.popen.poll()
        if returncode is not None and self._alive:
            self._alive = False
            self._report(str(Death(self._spec.executable, returncode, self._process.last_lines())))

    def _log_lines(self) -> list[str]:
        try:
            return self._log.read_text(errors='replace').splitlines(keepends=True)
        except OSError:  # the log was removed, or could not be written
            return []

    def __exit__(self, *_: object) -> None:
        try:
            self._end()
        finally:
            self._process.close()

    def _end(self) -> None:
        for number in (signal.SIGINT, signal.SIGKILL):
            self._process.send_signal(number)
            try:
                self._process.popen.wait(_PATIENCE_S)
                return
            except subprocess.TimeoutExpired:
                continue
