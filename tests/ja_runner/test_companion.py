"""A node beside the graph."""

import signal
import time
from collections.abc import Callable

import pytest

from ja_runner.companion import Companion
from ja_runner.node_spec import NodeSpec
from ros_testing import PATIENCE_S

TALKER = NodeSpec('dummy_nodes', 'talker')
STUBBORN = NodeSpec('dummy_nodes', 'stubborn')

pytestmark = pytest.mark.usefixtures('domain')


def report_until(companion: Companion, condition: Callable[[], object]) -> None:
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end
        companion.report_events()
        time.sleep(0.01)


def test_its_death_is_reported_once_and_raises_nothing(tmp_path):
    reports: list[str] = []
    with Companion(TALKER, tmp_path, reports.append, announcement='') as companion:
        companion._process.popen.send_signal(signal.SIGKILL)
        report_until(companion, lambda: reports)
        companion.report_events()
    assert len(reports) == 1
    assert 'talker was killed by SIGKILL' in reports[0]


def test_the_announcement_in_its_log_is_reported_once(tmp_path, monkeypatch):
    monkeypatch.setattr('ja_runner.companion._PATIENCE_S', 0.1)
    reports: list[str] = []
    with Companion(STUBBORN, tmp_path, reports.append, announcement='[ERROR]') as companion:
        report_until(companion, lambda: reports)
        companion.report_events()
    assert reports == ['[ERROR] [stubborn]: here I stand']


def test_one_that_ignores_signals_is_killed_with_the_context(tmp_path, monkeypatch):
    monkeypatch.setattr('ja_runner.companion._PATIENCE_S', 0.1)
    reports: list[str] = []
    with Companion(STUBBORN, tmp_path, reports.append, announcement='[ERROR]') as companion:
        report_until(companion, lambda: reports)  # it ignores SIGINT from here on
        popen = companion._process.popen
    assert popen.wait(PATIENCE_S) == -signal.SIGKILL


def test_it_ends_with_the_context(tmp_path):
    with Companion(TALKER, tmp_path, print, announcement='') as companion:
        popen = companion._process.popen
        assert popen.poll() is None
    assert popen.poll() is not None
