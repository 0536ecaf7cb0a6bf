"""Removal of the shared memory of Fast DDS that killed processes left behind.

Each process leaves some 9 MB in /dev/shm, and Fast DDS itself removes none of it: after a hundred
kills there is no room, and every node falls back to UDP. A running owner holds an exclusive lock
(flock(2)) on the file `_el` beside its segment, so no segment that any process uses is removed.
"""

import fcntl
import time
from pathlib import Path

FOLDER = Path('/dev/shm')
_LOCK_SUFFIX = '_el'
# A process that starts makes its files before it locks them.
_OLDER_THAN_S = 10.0


def remove_dead_segments(folder: Path = FOLDER, older_than_s: float = _OLDER_THAN_S) -> int:
    """Remove the segments whose owner is dead; return how many there were.

    Segments of ports, `fastrtps_port<number>`, stay: the next process with that number uses them.
    """
    removed = 0
    for lock in folder.glob(f'fastrtps_*{_LOCK_SUFFIX}'):
        segment = lock.with_name(lock.name.removesuffix(_LOCK_SUFFIX))
        if segment.name.startswith('fastrtps_port'):
            continue
        try:
            if time.time() - lock.stat().st_mtime < older_than_s:
                continue
            with lock.open() as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                segment.unlink(missing_ok=True)
                lock.unlink(missing_ok=True)
        except OSError:
            continue  # the owner runs, or is another user, or another supervisor was faster
        removed += 1
    return removed
