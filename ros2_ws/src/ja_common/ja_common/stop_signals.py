"""SIGINT, SIGTERM and SIGHUP as a request that a loop reads; no line of Python is interrupted.

Python's own handler raises KeyboardInterrupt wherever the main thread is, which may be inside the
constructor of a message or the write of a checkpoint, where nothing can handle it.
"""

import os
import signal
import socket
import threading
import time
from collections.abc import Callable
from types import FrameType, TracebackType

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

# One Ctrl-C reaches a process twice where a launcher forwards what the terminal sends to all.
_SAME_REQUEST_S = 0.1


def end_process(number: int) -> None:
    """End this process now, with the exit code of a process that a signal has ended."""
    os._exit(128 + number)


def end_quietly_at_sigint() -> None:
    """Let SIGINT end this process without a word, before there is anything to save.

    Python's handler would end an import with a traceback. Python sets it before any line of ours,
    so the program that starts this one blocks the signal until here.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


class StopSignals:
    """A context manager of the main thread: within it, the first signal is a request to stop.

    Every further signal calls `on_further` with its number; by default the process ends at once.
    Both reach the process also while the main thread waits in a library, because a thread of its
    own receives them.
    """

    def __init__(self, on_further: Callable[[int], None] = end_process) -> None:
        self._on_further = on_further
        self._on_first: list[Callable[[], None]] = []
        self._count = 0
        self._thread = threading.Thread(target=self._receive, name='stop signals', daemon=True)

    @property
    def requested(self) -> bool:
        """Return whether a signal has been received."""
        return self._count > 0

    @property
    def count(self) -> int:
        """Return how many signals have been received; those at the same moment count as one."""
        return self._count

    def raise_if_requested(self) -> None:
        """Raise KeyboardInterrupt if a signal has been received: a loop ends here alone."""
        if self.requested:
            raise KeyboardInterrupt

    def call_at_request(self, call: Callable[[], None]) -> None:
        """Call this, in another thread, at the first signal; use it to wake the main thread."""
        self._on_first.append(call)
        if self.requested:
            call()

    def __enter__(self) -> 'StopSignals':
        self._receiver, self._sender = socket.socketpair()
        self._sender.setblocking(False)  # as `set_wakeup_fd` requires
        self._fd_before = signal.set_wakeup_fd(self._sender.fileno(), warn_on_full_buffer=False)
        self._before = {
            number: signal.signal(number, _leave_to_the_thread)
            for number in STOP_SIGNALS
            # nohup(1) ignores the hang-up for its command, which has to stay so.
            if not (number is signal.SIGHUP and signal.getsignal(number) is signal.SIG_IGN)
        }
        self._thread.start()
        return self

    def __exit__(
        self,
        _type: type[BaseException] | None,
        _error: BaseException | None,
        _traceback: TracebackType | None,
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(self._fd_before)
        self._sender.close()  # ends the thread
        self._thread.join()
        self._receiver.close()

    def _receive(self) -> None:
        while numbers := self._receiver.recv(64):
            for number in numbers:
                if number in self._before:  # not a signal that another part of the process handles
                    self._take(number)

    def _take(self, number: int) -> None:
        now_s = time.monotonic()
        if not self.requested:
            self._requested_at_s = now_s
            self._count = 1
            for call in self._on_first:
                call()
        elif now_s - self._requested_at_s > _SAME_REQUEST_S:
            self._count += 1
            self._on_further(number)


def _leave_to_the_thread(_number: int, _frame: FrameType | None) -> None:
    """Do nothing: Python has written the signal's number to the socket already."""
