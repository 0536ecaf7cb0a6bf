"""Shared memory of killed processes is removed; that of running processes is not."""

import fcntl
import os
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from ja_runner import dead_segments
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


def make_socket(path: Path) -> None:
    """Leave a socket at the path; its address may not be longer than some 100 characters."""
    here = os.open(path.parent, os.O_DIRECTORY)
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(f'/proc/self/fd/{here}/{path.name}')
    finally:
        os.close(here)


FOREIGN: dict[str, Callable[[Path], object]] = {
    'fifo': os.mkfifo,
    'folder': Path.mkdir,
    'socket': make_socket,
    'link to a file': lambda path: path.symlink_to(__file__),
    'link to nowhere': lambda path: path.symlink_to('nowhere'),
    'link to itself': lambda path: path.symlink_to(path.name),
}


def test_only_unlocked_segments_are_removed(tmp_path):
    for name in ('dead', 'alive', 'port7411'):
        for suffix in ('', '_el'):
            (tmp_path / f'fastrtps_{name}{suffix}').touch()
    with (tmp_path / 'fastrtps_alive_el').open() as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert remove_dead_segments(tmp_path) == 1
    left = {path.name.removeprefix('fastrtps_') for path in tmp_path.iterdir()}
    assert left == {'alive', 'alive_el', 'port7411', 'port7411_el'}
    assert remove_dead_segments(tmp_path / 'nowhere') == 0


@pytest.mark.parametrize('days', [-1, 1])
def test_no_clock_decides(tmp_path, days):
    for suffix in ('', '_el'):
        path = tmp_path / f'fastrtps_dead{suffix}'
        path.touch()
        then_s = path.stat().st_mtime + 86400 * days
        os.utime(path, (then_s, then_s))
    assert remove_dead_segments(tmp_path) == 1


def test_a_lock_without_segment_is_removed(tmp_path):
    (tmp_path / 'fastrtps_dead_el').touch()
    assert remove_dead_segments(tmp_path) == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize('suffix', ['', '_el'])
@pytest.mark.parametrize('kind', FOREIGN)
def test_nothing_foreign_is_waited_for_or_removed(tmp_path, kind, suffix):
    for ours in {'', '_el'} - {suffix}:
        (tmp_path / f'fastrtps_x{ours}').touch()
    FOREIGN[kind](tmp_path / f'fastrtps_x{suffix}')
    assert remove_dead_segments(tmp_path) == 0
    assert {path.name for path in tmp_path.iterdir()} == {'fastrtps_x', 'fastrtps_x_el'}


def test_files_of_other_users_stay(tmp_path, monkeypatch):
    for suffix in ('', '_el'):
        (tmp_path / f'fastrtps_x{suffix}').touch()
    another = os.geteuid() + 1
    monkeypatch.setattr(dead_segments.os, 'geteuid', lambda: another)
    assert remove_dead_segments(tmp_path) == 0
    assert len(list(tmp_path.iterdir())) == 2


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
