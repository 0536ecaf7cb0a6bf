"""A node beside the graph, in a process of its own: its death is told, and ends nothing."""

import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

from ja_runner.graph import NodeSpec
from ja_runner.supervisor import Death, NodeProcess

_PATIENCE_S = 3.0


class Companion:
    """As a context manager: runs the node; `look` at it now and then.

    The first line of its log that begins with `news` is told, and so is its death.
    """

    def __init__(
        self, spec: NodeSpec, log_folder: Path, say: Callable[[str], None], news: str
    ) -> None:
        log_folder.mkdir(parents=True, exist_ok=True)
        self._spec = spec
        self._log = log_folder / f'{spec.thing}.log'
        self._say = say
        self._news = news
        self._alive = True

    def __enter__(self) -> 'Companion':
        self._process = NodeProcess(self._spec, self._log)
        return self

    def look(self) -> None:
        """Tell what there is to tell, once."""
        if self._news:
            lines = self._log.read_text(errors='replace').splitlines(keepends=True)
            for line in lines:
                if line.startswith(self._news) and line.endswith('\n'):
                    self._news = ''
                    self._say(line.strip())
                    break
        returncode = self._process.popen.poll()
        if returncode is not None and self._alive:
            self._alive = False
            self._say(str(Death(self._spec.thing, returncode, self._process.last_lines())))

    def __exit__(self, *_: object) -> None:
        for number in (signal.SIGINT, signal.SIGKILL):
            self._process.signal(number)
            try:
                self._process.popen.wait(_PATIENCE_S)
                return
            except subprocess.TimeoutExpired:
                continue
