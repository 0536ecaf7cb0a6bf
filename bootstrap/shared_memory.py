"""Is there room in /dev/shm for ROS to start? Without, it ends with 'Bus error' at its import."""

from __future__ import annotations

import os
import re
from pathlib import Path

from bootstrap.plan import BootstrapError

# LTTng, which rclpy is linked with, maps a page of a file for all users and one for this user.
_FILES = 2


def check_shared_memory(folder: Path = Path('/dev/shm')) -> None:
    """Raise BootstrapError where rclpy could not be imported because the folder is full."""
    if not os.access(folder, os.W_OK):
        return  # not there, or read-only: ROS goes on without it
    name = re.compile(rf'lttng-ust-wait-\d+(-{os.getuid()})?')
    # A file that has blocks has got its page when there was room.
    there = sum(
        path.stat().st_blocks > 0 for path in folder.iterdir() if name.fullmatch(path.name)
    )
    disk = os.statvfs(folder)
    # A size of 0 is that of a tmpfs without limit.
    if disk.f_blocks and disk.f_bavail < _FILES - there:
        raise BootstrapError(
            f'{folder} is full, and ROS cannot start: when no other ROS program runs, '
            f'`rm {folder}/fastrtps_* {folder}/sem.fastrtps_*`, or give a container more '
            '(--shm-size=512m)'
        )
