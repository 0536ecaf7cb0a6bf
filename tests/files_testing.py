"""Disks that refuse a write, for every user: root ignores permissions."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def disk_with_room_for(size: int) -> Iterator[None]:
    """Let this process write no byte of a file beyond `size` (EFBIG), as on a disk that is full.

    Not for a block in which ROS starts: its shared memory is made of files as well.
    """
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
