"""Removal of the shared memory of Fast DDS that killed processes left behind.

Each process leaves some 9 MB in /dev/shm, and Fast DDS itself removes none of it: after a hundred
kills there is no room, and every node falls back to UDP. A running owner holds an exclusive lock
(flock(2)) on the file `_el` beside its segment, so no segment that any process uses is removed.
Fast DDS locks before it makes the segment, and makes a lock file anew that was removed between
opening and locking: no age, and so no clock, has to decide.
"""

import fcntl
import os
import stat
from pathlib import Path

FOLDER = Path('/dev/shm')
_LOCK_SUFFIX = '_el'
# A FIFO must not keep us waiting for a writer, and a link must not lead out of the folder.
_OPEN_FLAGS = os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC


def remove_dead_segments(folder: Path = FOLDER) -> int:
    """Remove the segments whose owner is dead; return how many there were.

    Only regular files of this user are touched. Segments of ports, `fastrtps_port<number>`, stay:
    the next process with that number uses them.
    """
    locks = folder.glob(f'fastrtps_*{_LOCK_SUFFIX}')
    return sum(_remove_if_dead(lock) for lock in locks if not _is_port(lock))


def _is_port(lock: Path) -> bool:
    return lock.name.startswith('fastrtps_port')


def _remove_if_dead(lock: Path) -> bool:
    segment = lock.with_name(lock.name.removesuffix(_LOCK_SUFFIX))
    try:
        descriptor = os.open(lock, _OPEN_FLAGS)
    except OSError:
        return False  # a link or a socket, of another user, or another supervisor was faster
    try:
        if not _is_own_file(os.fstat(descriptor)):
            return False
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # Where a process died between locking and making its segment, there is the lock alone.
        if os.path.lexists(segment):
            if not _is_own_file(segment.lstat()):
                return False
            segment.unlink()
        lock.unlink()
    except OSError:
        return False  # the owner runs, or another supervisor was faster
    finally:
        os.close(descriptor)
    return True


def _is_own_file(status: os.stat_result) -> bool:
    return stat.S_ISREG(status.st_mode) and status.st_uid == os.geteuid()
