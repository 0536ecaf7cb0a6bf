"""Shared memory of killed processes is removed; that of running processes is not."""

import fcntl
import os
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from ja_runner.dead_segments import FOLDER, remove_dead_segments

PARTICIPANT = """
from ja_common.ros_defaults import apply_ros_defaults
apply_ros_defaults()
import rclpy, signal
rclpy.init()
node = rclpy.create_node('segments')
print('ready', flush=True)
signal.pause()
"""


def test_only_unlocked_old_segments_are_removed(tmp_path):
    for name in ('dead', 'alive', 'young', 'port7411'):
        for suffix in ('', '_el'):
            path = tmp_path / f'fastrtps_{name}{suffix}'
            path.touch()
            if name != 'young':
                os.utime(path, (0.0, 0.0))
    with (tmp_path / 'fastrtps_alive_el').open() as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert remove_dead_segments(tmp_path) == 1
    left = {path.name.removeprefix('fastrtps_') for path in tmp_path.iterdir()}
    assert left == {'alive', 'alive_el', 'young', 'young_el', 'port7411', 'port7411_el'}
    assert remove_dead_segments(tmp_path / 'nowhere') == 0


@pytest.mark.usefixtures('domain')
def test_fast_dds_locks_its_segments_as_long_as_it_runs():
    process = subprocess.Popen([sys.executable, '-c', PARTICIPANT], stdout=subprocess.PIPE)
    try:
        assert process.stdout.readline()
        paths = (mapped.path for mapped in psutil.Process(process.pid).memory_maps())
        mapped = {path for path in paths if path.startswith(f'{FOLDER}/fastrtps_')}
        locks = [Path(f'{path}_el') for path in mapped if 'fastrtps_port' not in path]
        assert locks
        for lock in locks:
            with lock.open() as file, pytest.raises(BlockingIOError):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    finally:
        process.kill()
        process.wait()
    for lock in locks:
        with lock.open() as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
