"""A node beside the graph."""

import signal
import time
from collections.abc import Callable

import pytest

from ja_runner.companion import Companion
from ja_runner.node_spec import NodeSpec

TALKER = NodeSpec('dummy_nodes', 'talker')
STUBBORN = NodeSpec('dummy_nodes', 'stubborn')

pytestmark = pytest.mark.usefixtures('domain')


def look_until(companion: Companion, condition: Callable[[], object]) -> None:
    end = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < end
        companion.report_events()
        time.sleep(0.01)


def test_its_death_is_told_once_and_raises_nothing(tmp_path):
    said: list[str] = []
    with Companion(TALKER, tmp_path, said.append, announcement='') as companion:
        companion._process.popen.send_signal(signal.SIGKILL)
        look_until(companion, lambda: said)
        companion.report_events()
    assert len(said) == 1
    assert 'talker was killed by SIGKILL' in said[0]


def test_it_ends_with_the_context(tmp_path):
    with Companion(TALKER, tmp_path, print, announcement='') as companion:
        popen = companion._process.popen
        assert popen.poll() is None
    assert popen.poll() is not None
