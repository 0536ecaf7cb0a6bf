"""A full /dev/shm ends ROS by 'Bus error' at its import: one sentence comes before."""

import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from bootstrap import shared_memory
from bootstrap.plan import BootstrapError
from bootstrap.shared_memory import check_shared_memory
from mounts import needs_mounts, run_with_shared_memory

OURS = f'lttng-ust-wait-6-{os.getuid()}'
IMPORT = 'import rclpy'
CHECK = 'from bootstrap.shared_memory import check_shared_memory; check_shared_memory()'


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch):
    """Return a function that sets how many pages are free."""

    def set_free(pages: int, of: int = 256) -> None:
        found = SimpleNamespace(f_blocks=of, f_bavail=pages)
        monkeypatch.setattr(shared_memory.os, 'statvfs', lambda _: found)

    return set_free


@pytest.mark.parametrize(
    ('there', 'free', 'ok'),
    [
        ((), 2, True),
        ((), 1, False),
        (('lttng-ust-wait-6',), 1, True),
        (('lttng-ust-wait-6',), 0, False),
        ((OURS,), 0, False),
        (('lttng-ust-wait-6', f'{OURS}7', 'lttng-ust-wait-6.txt'), 0, False),
        (('lttng-ust-wait-6', OURS), 0, True),
    ],
)
def test_each_of_the_two_files_needs_a_page(tmp_path, disk, there, free, ok):
    for name in there:
        (tmp_path / name).write_bytes(b'\1' * 4096)
    disk(free)
    if ok:
        check_shared_memory(tmp_path)
    else:
        with pytest.raises(BootstrapError, match=rf'{tmp_path} is full.*rm .*--shm-size'):
            check_shared_memory(tmp_path)


def test_a_file_without_its_page_does_not_count(tmp_path, disk):
    for name in ('lttng-ust-wait-6', OURS):
        with (tmp_path / name).open('wb') as file:
            file.truncate(4096)
    disk(1)
    with pytest.raises(BootstrapError):
        check_shared_memory(tmp_path)


def test_no_folder_and_no_limit_are_no_error(tmp_path, disk):
    check_shared_memory(tmp_path / 'none')
    disk(0, of=0)
    check_shared_memory(tmp_path)


@needs_mounts
@pytest.mark.parametrize('free', [0, 1, 2])
def test_the_check_is_right_about_rclpy(free):
    root = Path(__file__).parents[2]
    imported = run_with_shared_memory('size=1m', IMPORT, free_pages=free, cwd=root)
    checked = run_with_shared_memory('size=1m', CHECK, free_pages=free, cwd=root)
    assert (imported.returncode == 0) == (checked.returncode == 0)
    assert checked.returncode == 0 or 'ROS cannot start' in checked.stderr
