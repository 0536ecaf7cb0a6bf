"""`python -m ja_runner.child MODULE ARGS`: run a node; it ends with its parent."""

import ctypes
import faulthandler
import importlib
import os
import signal
import sys

from ja_common.stop_signals import end_quietly_at_sigint

_PR_SET_PDEATHSIG = 1
PARENT = 'JA_PARENT_PID'

STACK_SIGNAL = signal.SIGUSR1
"""At this signal a node writes the stack of each thread to its log, and runs on."""


def end_with_parent(parent: int) -> None:
    """Ask the kernel to kill this process when its parent dies, even by SIGKILL.

    The signal is SIGKILL, so that a frozen node cannot stay behind and move a head.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL) != 0:
        raise OSError(ctypes.get_errno(), 'prctl(PR_SET_PDEATHSIG) failed')
    if os.getppid() != parent:
        sys.exit('the supervisor ended before this node started')


def main() -> None:
    """Run the `main` of the node's module, which the command line names."""
    end_quietly_at_sigint()  # until the node takes over; the supervisor has blocked it
    faulthandler.enable()
    faulthandler.register(STACK_SIGNAL)
    module = sys.argv[1]
    if PARENT in os.environ:
        end_with_parent(int(os.environ[PARENT]))
    sys.argv = [module, *sys.argv[2:]]
    importlib.import_module(module).main()
    _end()


def _end() -> None:
    """End without the interpreter's own end, which takes seconds with torch on a busy machine.

    The node has ended, and with it its participant of DDS, its threads and its files.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


if __name__ == '__main__':
    main()
