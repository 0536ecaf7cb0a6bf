"""The heartbeat of a node's process: a byte a second into a pipe of the supervisor.

A pipe and not a topic, because a process whose middleware has locked up must be noticed too, and
because a supervisor must not take a node for hung when its own middleware is.
"""

import contextlib
import os
from collections.abc import Callable, Mapping

FILE_DESCRIPTOR = 'JA_HEARTBEAT_FD'
"""Environment variable: the pipe's descriptor, which the supervisor sets and passes on."""

PERIOD_S = 1.0


def heartbeat(environ: Mapping[str, str] = os.environ) -> Callable[[], None] | None:
    """Return the call that sends one beat; None without a supervisor."""
    if FILE_DESCRIPTOR not in environ:
        return None
    pipe = int(environ[FILE_DESCRIPTOR])
    os.set_blocking(pipe, False)

    def beat() -> None:
        # Full: the supervisor is halted. Broken: it has ended, and this process ends with it.
        with contextlib.suppress(BlockingIOError, BrokenPipeError):
            os.write(pipe, b'.')

    return beat
