"""Can images go from process to process here: by shared memory, or else by UDP?"""

import os
import shutil
from pathlib import Path

SHARED_MEMORY = Path('/dev/shm')
ENOUGH_SHARED_MB = 64
"""The processes of a graph have about 9 MB each."""

SOCKET_BUFFER_BYTES = 4 * 2**20
"""In the profiles of Fast DDS: an image that waits as a whole in a socket is not lost."""

_BUFFER_LIMIT = Path('/proc/sys/net/core/rmem_max')


def free_shared_memory_mb(folder: Path = SHARED_MEMORY) -> int:
    """Return how much shared memory can be used [MB]; 0 where the folder cannot be written."""
    return shutil.disk_usage(folder).free // 10**6 if os.access(folder, os.W_OK) else 0


def socket_buffer_advice(limit_file: Path = _BUFFER_LIMIT) -> str:
    """Return how to let UDP carry images; '' if it can, or if this system has no such limit."""
    try:
        limit = int(limit_file.read_text())
    except (OSError, ValueError):
        return ''
    if limit >= SOCKET_BUFFER_BYTES:
        return ''
    return f'sudo sysctl -w net.core.rmem_max={SOCKET_BUFFER_BYTES}'


def image_loss_warning(folder: Path = SHARED_MEMORY, limit_file: Path = _BUFFER_LIMIT) -> str:
    """Return a sentence where neither way has room for images; '' if one has."""
    free_mb, advice = free_shared_memory_mb(folder), socket_buffer_advice(limit_file)
    if free_mb >= ENOUGH_SHARED_MB or not advice:
        return ''
    return (
        f'images may be lost between processes: {folder} has {free_mb} MB for them, of '
        f'{ENOUGH_SHARED_MB} MB, and the kernel keeps the buffers of UDP small; make {folder} '
        f'larger (docker run --shm-size=512m), or `{advice}`, or use --one-process'
    )
