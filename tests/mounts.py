"""Processes with a /dev/shm of their own, where the system lets us make one."""

import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from ros_testing import PATIENCE_S

_tried = subprocess.run(
    'unshare --mount mount -t tmpfs tmpfs /dev/shm',
    shell=True, capture_output=True, text=True, check=False,
)  # fmt: skip
needs_mounts = pytest.mark.skipif(
    _tried.returncode != 0, reason=f'no mounts of its own: {_tried.stderr.strip()} (needs root)'
)


def with_shared_memory(
    options: str, command: list[str], free_pages: int | None = None
) -> list[str]:
    """Return the command line that runs a command with a fresh tmpfs at /dev/shm.

    `options`: those of mount, such as `size=1m` or `ro`. `free_pages`: fill it but for so many.
    """
    steps = [f'mount -t tmpfs -o {options} tmpfs /dev/shm']
    if free_pages is not None:
        steps.append(
            'head -c $(df -B1 --output=avail /dev/shm | tail -1) /dev/zero > /dev/shm/full'
        )
        steps.append(f'truncate -s -{free_pages * 4096} /dev/shm/full')
    return ['unshare', '--mount', 'sh', '-c', ' && '.join([*steps, f'exec {shlex.join(command)}'])]


def run_with_shared_memory(
    options: str, program: str, free_pages: int | None = None, cwd: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a Python program with a fresh tmpfs at /dev/shm, as `with_shared_memory`."""
    command = with_shared_memory(options, [sys.executable, '-c', program], free_pages)
    return subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=cwd, timeout=PATIENCE_S
    )
