"""`python -m ja_runner.child MODULE ARGS`: be that node, and never outlive who started it."""

import ctypes
import importlib
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1
PARENT = 'JA_PARENT_PID'


def end_with_parent(parent: int) -> None:
    """Ask the kernel to kill this process when its parent dies, even by SIGKILL.

    SIGKILL here too: a node that is frozen must not stay behind, moving a head.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL) != 0:
        raise OSError(ctypes.get_errno(), 'prctl(PR_SET_PDEATHSIG) failed')
    if os.getppid() != parent:
        sys.exit('the supervisor has ended before this node began')


def main() -> None:
    module = sys.argv[1]
    if PARENT in os.environ:
        end_with_parent(int(os.environ[PARENT]))
    sys.argv = [module, *sys.argv[2:]]
    node = importlib.import_module(module)
    try:
        # The supervisor starts us with SIGINT blocked: in the middle of an import it would end
        # in a traceback. One that came meanwhile is delivered here.
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        node.main()
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
