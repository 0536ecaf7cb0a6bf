"""`python -m ja_runner.child MODULE ARGS`: run a node; it ends with its parent."""

import ctypes
import importlib
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1
PARENT = 'JA_PARENT_PID'


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
    module = sys.argv[1]
    if PARENT in os.environ:
        end_with_parent(int(os.environ[PARENT]))
    sys.argv = [module, *sys.argv[2:]]
    node = importlib.import_module(module)
    try:
        # The supervisor starts this process with SIGINT blocked, because SIGINT during an import
        # would end in a traceback. A SIGINT that arrived meanwhile is delivered here.
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        node.main()
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
