"""One node as a process: started, watched by its heartbeat, its log read, signalled."""

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from ja_common.heartbeat import FILE_DESCRIPTOR
from ja_runner.child import PARENT, STACK_SIGNAL
from ja_runner.node_spec import NodeSpec

START_LIMIT_S = 120.0
"""A node without a heartbeat for so long [s] after its start is hung; a busy machine is slow."""

_TAIL_LINES = 8
_SHOWN_LEVELS = ('[ERROR]', '[FATAL]')  # warnings reach the display through /diagnostics
_STACK_HEAD = '(most recent call first):'
_STACK_WRITTEN_WITHIN_S = 1.0
# A gap this long between two looks [s] is the supervisor's own: it was halted, or it was slow.
_LOOKED_LATE_S = 1.0


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
        self.log = log
        self._read_up_to = 0
        self._heartbeat: int | None = None
        self.start()

    def start(self) -> None:
        """Start the process, or a new one in place of one that ended."""
        self.close()
        self._heartbeat, pipe = os.pipe()
        os.set_blocking(self._heartbeat, False)
        self.began_s = self._alive_s = self._looked_s = time.monotonic()
        self.beats = False
        environ = {
            **os.environ,
            # Otherwise Python buffers, and loses, the last lines of a node that dies.
            'PYTHONUNBUFFERED': '1',
            **self.spec.environ,
            PARENT: str(os.getpid()),
            FILE_DESCRIPTOR: str(pipe),
        }
        try:
            with self._open_log() as log, _signal_blocked(signal.SIGINT):
                self._starts_at = os.fstat(log.fileno()).st_size
                # A session of its own: Ctrl-C reaches only the supervisor, which stops all in
                # order.
                self.popen = subprocess.Popen(
                    self.spec.command(),
                    env=environ,
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                    pass_fds=(pipe,),
                )
        finally:
            os.close(pipe)

    def close(self) -> None:
        """Let go of the pipe of the heartbeat."""
        if self._heartbeat is not None:
            os.close(self._heartbeat)
            self._heartbeat = None

    def send_signal(self, number: int) -> None:
        """Send a signal, unless the process has ended."""
        if self.popen.poll() is None:
            self.popen.send_signal(number)

    def hung_s(self, hung_after_s: float) -> float:
        """Return for how long the node has been without a heartbeat [s], or 0.0 if it is not hung.

        Before its first heartbeat a node may take START_LIMIT_S; one of another package, which may
        know of no heartbeat (`NodeSpec.has_heartbeat`), for ever. Call this at least every second.
        """
        now_s = time.monotonic()
        late_s, self._looked_s = now_s - self._looked_s, now_s
        if late_s > _LOOKED_LATE_S:
            self._alive_s += late_s
        if self._take_beats():
            self.beats, self._alive_s = True, now_s
        if not (self.beats or self.spec.has_heartbeat):
            return 0.0
        silent_s = now_s - self._alive_s
        return silent_s if silent_s > (hung_after_s if self.beats else START_LIMIT_S) else 0.0

    def kill_with_stack(self) -> str:
        """Kill a hung node; before, let it write its stack to its log. Return the lines to show.

        A stopped process (SIGSTOP) is not continued for that: it would go on to act for a moment.
        """
        self.send_signal(STACK_SIGNAL)
        end_s = time.monotonic() + _STACK_WRITTEN_WITHIN_S
        while time.monotonic() < end_s and not (stack := self._stack()):
            time.sleep(0.02)
        self.send_signal(signal.SIGKILL)
        with suppress(subprocess.TimeoutExpired):  # in a driver, which must return first
            self.popen.wait(_STACK_WRITTEN_WITHIN_S)
        return _indented(stack) or self.last_lines()

    def last_lines(self) -> str:
        """Return the last lines of the log since the last start, indented."""
        return _indented(self._lines()[-_TAIL_LINES:])

    def new_errors(self) -> list[str]:
        """Return the errors that the node has logged since the last call."""
        written = self._read(self._read_up_to)
        complete = written[: written.rfind(b'\n') + 1]
        self._read_up_to += len(complete)
        lines = complete.decode(errors='replace').splitlines()
        return [line for line in lines if line.startswith(_SHOWN_LEVELS)]

    def _take_beats(self) -> bool:
        assert self._heartbeat is not None
        with suppress(BlockingIOError):
            return bool(os.read(self._heartbeat, 4096))
        return False

    def _stack(self) -> list[str]:
        """Return the innermost calls of the main thread, which faulthandler writes last."""
        lines = self._lines()
        heads = [i for i, line in enumerate(lines) if line.endswith(_STACK_HEAD)]
        return lines[heads[-1] :][:_TAIL_LINES] if heads else []

    def _lines(self) -> list[str]:
        return self._read(self._starts_at).decode(errors='replace').splitlines()

    def _open_log(self) -> IO[bytes]:
        """Open the log to write; a node whose log cannot be written runs without one."""
        try:
            self.log.parent.mkdir(parents=True, exist_ok=True)
            return self.log.open('ab')
        except OSError:
            return open(os.devnull, 'ab')

    def _read(self, start: int) -> bytes:
        try:
            with self.log.open('rb') as log:
                log.seek(start)
                return log.read()
        except OSError:  # removed, or never written: no reason to end a graph
            return b''


def _indented(lines: list[str]) -> str:
    return '\n'.join(f'  {line}' for line in lines)
