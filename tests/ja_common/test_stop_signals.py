"""Stop signals: a request that interrupts nothing, a second one that ends at once."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import pytest

from ja_common.stop_signals import STOP_SIGNALS, StopSignals
from ros_testing import PATIENCE_S, wait_for


@pytest.fixture
def heeded_hang_up() -> Iterator[None]:
    """Let SIGHUP have its default effect, also where the tests themselves run under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.usefixtures('heeded_hang_up')
@pytest.mark.parametrize('number', STOP_SIGNALS)
def test_a_signal_is_a_request_and_the_handlers_come_back(number):
    before = {n: signal.getsignal(n) for n in STOP_SIGNALS}
    woken = threading.Event()
    with StopSignals() as stop:
        stop.call_at_request(woken.set)
        stop.raise_if_requested()
        os.kill(os.getpid(), number)
        assert woken.wait(PATIENCE_S)
        assert stop.requested
        with pytest.raises(KeyboardInterrupt):
            stop.raise_if_requested()
    assert {n: signal.getsignal(n) for n in STOP_SIGNALS} == before
    assert signal.set_wakeup_fd(-1) == -1


def test_two_signals_at_the_same_moment_are_one_request():
    further = []
    with StopSignals(further.append) as stop:
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGTERM)
        wait_for(lambda: stop.requested)
        time.sleep(0.2)
        assert (stop.count, further) == (1, [])
        os.kill(os.getpid(), signal.SIGTERM)
        wait_for(lambda: further)
    assert (stop.count, further) == (2, [signal.SIGTERM])


def test_a_signal_of_others_is_no_request():
    taken = []
    before = signal.signal(signal.SIGUSR2, lambda number, _: taken.append(number))
    try:
        with StopSignals() as stop:
            os.kill(os.getpid(), signal.SIGUSR2)
            wait_for(lambda: taken)
            time.sleep(0.1)
            assert not stop.requested
    finally:
        signal.signal(signal.SIGUSR2, before)


def test_a_late_call_is_made_at_once():
    called = []
    with StopSignals() as stop:
        os.kill(os.getpid(), signal.SIGINT)
        wait_for(lambda: stop.requested)
        stop.call_at_request(lambda: called.append(1))
    assert called == [1]


def test_nohup_is_respected():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with StopSignals() as stop:
            os.kill(os.getpid(), signal.SIGHUP)
            time.sleep(0.1)
            assert not stop.requested
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


HANGING = """
import time
from ja_common.stop_signals import StopSignals
with StopSignals() as stop:
    stop.call_at_request(lambda: print('asked', flush=True))
    print('ready', flush=True)
    time.sleep(3600)
"""


def test_a_second_signal_ends_a_process_that_hangs():
    process = subprocess.Popen([sys.executable, '-c', HANGING], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == 'ready\n'
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline() == 'asked\n'
    time.sleep(0.2)
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=PATIENCE_S) == 128 + signal.SIGTERM
    process.stdout.close()
