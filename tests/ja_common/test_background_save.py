"""Saving in the background: the caller never waits, and what failed is saved later."""

import threading

import pytest

from ja_common.core.background_save import BackgroundSave
from ros_testing import PATIENCE_S


class Disk:
    """Saves a value; fails while it is full, and lets a test wait for each attempt."""

    def __init__(self):
        self.value, self.saved, self.full = 0, None, False
        self.attempts = threading.Semaphore(0)
        self.open = threading.Event()
        self.open.set()

    def save(self):
        assert self.open.wait(PATIENCE_S)
        value = self.value
        if not self.full:
            self.saved = value
        self.attempts.release()
        if self.full:
            raise OSError(28, 'No space left on device')

    def wait(self, attempts=1):
        for _ in range(attempts):
            assert self.attempts.acquire(timeout=PATIENCE_S)


@pytest.fixture
def disk():
    return Disk()


@pytest.fixture
def background(disk):
    background = BackgroundSave(disk.save, retry_s=0.01)
    yield background
    background.close()


def test_a_request_is_saved_once(disk, background):
    disk.value = 7
    background.request()
    disk.wait()
    background.close()
    assert disk.saved == 7
    assert background.error is None
    assert not disk.attempts.acquire(blocking=False)


def test_a_failed_save_is_tried_until_it_succeeds(disk, background):
    disk.full, disk.value = True, 1
    background.request()
    disk.wait(attempts=3)  # without a further request
    assert isinstance(background.error, OSError)
    disk.value, disk.full = 2, False
    while disk.saved is None:
        disk.wait()
    background.close()
    assert disk.saved == 2
    assert background.error is None


def test_a_disk_that_stands_still_keeps_only_the_thread(disk, background):
    disk.open.clear()
    for disk.value in range(1, 101):
        background.request()  # returns at once
    disk.open.set()
    background.close()
    assert disk.saved == 100
    disk.wait()
    disk.attempts.acquire(blocking=False)  # a second call for what came during the first
    assert not disk.attempts.acquire(blocking=False)


def test_at_the_end_it_is_tried_once_more(disk, background):
    disk.full = True
    background.request()
    disk.wait()
    disk.full = False
    background.close()
    assert disk.saved == 0
    assert background.error is None


def test_what_could_not_be_saved_at_the_end_is_known(disk, background):
    disk.full = True
    background.request()
    background.close()
    assert isinstance(background.error, OSError)
