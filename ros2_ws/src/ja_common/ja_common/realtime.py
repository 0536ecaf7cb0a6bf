"""Real-time scheduling, for a process that must answer in time."""

import contextlib
import os
from pathlib import Path


def enable_realtime_scheduling(priority: int) -> None:
    """Schedule all threads of this process, and those that they start, as real-time (SCHED_RR).

    `priority`: 1-99. Raises OSError with one sentence where the system does not allow it.
    """
    if not hasattr(os, 'sched_setscheduler'):
        raise OSError('real-time priority is not available on this system: default priority')
    try:
        _schedule_all_threads(os.SCHED_RR, priority)
    except PermissionError:
        raise PermissionError(
            f'real-time priority {priority} is not allowed to this user: be root, or raise '
            'rtprio in /etc/security/limits.conf; until then default priority'
        ) from None


def restore_scheduling() -> None:
    """Schedule all threads by default again, after `enable_realtime_scheduling`."""
    if hasattr(os, 'sched_setscheduler'):
        _schedule_all_threads(os.SCHED_OTHER, 0)


def use_default_scheduling() -> None:
    """Schedule the calling thread by default, however its parent thread is scheduled."""
    if hasattr(os, 'sched_setscheduler'):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def _schedule_all_threads(policy: int, priority: int) -> None:
    for thread in Path('/proc/self/task').iterdir():
        with contextlib.suppress(ProcessLookupError):  # it has ended meanwhile
            os.sched_setscheduler(int(thread.name), policy, os.sched_param(priority))
