"""Supervised processes: they start, publish, die, and never stay behind."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import psutil
import pytest
from rclpy.node import Node
from std_msgs.msg import String

from ja_common.executor import CachedWaitSetExecutor
from ja_runner import node_process
from ja_runner.node_spec import NodeSpec
from ja_runner.supervisor import Supervision, Supervisor
from ros_testing import PATIENCE_S, wait_for

pytestmark = pytest.mark.usefixtures('domain')

TALKER = NodeSpec('dummy_nodes', 'talker')
CRASHER = NodeSpec('dummy_nodes', 'talker', {'text': 'crash'})
HANGING = NodeSpec('dummy_nodes', 'talker', {'text': 'hang'})
STUBBORN = NodeSpec('dummy_nodes', 'stubborn')


def alive(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


class SupervisedRun:
    """A supervisor in this process, with its reports and all process ids that it has started."""

    def __init__(self, graph: list[NodeSpec], folder: Path, **options: Any) -> None:
        self.reports: list[str] = []
        self.supervisor = Supervisor(graph, folder, Supervision(**options), self.reports.append)
        self.pids: set[int] = set()

    def until(self, condition: Callable[[], object], timeout_s: float = PATIENCE_S) -> int:
        end = time.monotonic() + timeout_s

        def tick() -> bool:
            assert time.monotonic() < end, f'not done in time; reported: {self.reports}'
            self.pids |= set(self.supervisor.pids.values())
            time.sleep(0.01)
            return bool(condition())

        return self.supervisor.run(tick)

    def log(self, executable: str, folder: Path) -> str:
        return (folder / f'{executable}.log').read_text()


def test_nodes_talk_and_end_cleanly(ros_context, tmp_path):
    node = Node('listener', context=ros_context)
    heard: list[str] = []
    node.create_subscription(String, 'talk', lambda message: heard.append(message.data), 10)
    executor = CachedWaitSetExecutor(context=ros_context)
    executor.add_node(node)
    spec = NodeSpec(
        'dummy_nodes', 'talker', {'text': 'ahoy'}, {'chatter': '/talk', '__ns': '/ship'}
    )
    run = SupervisedRun([spec], tmp_path)

    def listened() -> bool:
        executor.spin_once(timeout_sec=0.02)
        return bool(heard)

    code = run.until(listened)
    executor.shutdown()
    node.destroy_node()
    assert code == 0
    assert heard[0] == 'ahoy from /ship/talker'
    assert run.reports == []
    assert run.log('talker', tmp_path) == ''
    assert not any(map(alive, run.pids))


def test_when_one_dies_the_rest_is_stopped_and_the_death_explained(tmp_path):
    other = NodeSpec('dummy_nodes', 'stubborn')
    run = SupervisedRun([other, CRASHER], tmp_path, patience_s=0.3)
    assert run.until(lambda: False) == 1
    report = next(line for line in run.reports if line.startswith('talker'))
    assert 'talker ended with exit code 7' in report
    assert 'the wheel came off' in report
    assert not any(map(alive, run.pids))


def test_a_log_folder_that_vanishes_ends_no_graph(tmp_path):
    folder = tmp_path / 'log'
    run = SupervisedRun([TALKER], folder, on_death='restart')
    killed: list[int] = []

    def replaced_without_a_log() -> bool:
        pid = run.supervisor.pids['talker']
        if not killed:
            (folder / 'talker.log').unlink()
            folder.rmdir()
            folder.write_text('a file in the place of the folder')
            os.kill(pid, signal.SIGKILL)
            killed.append(pid)
        return pid != killed[0] and alive(pid)

    assert run.until(replaced_without_a_log) == 0
    assert folder.is_file()
    assert not any(map(alive, run.pids))


def test_a_killed_node_is_restarted_when_asked_to(tmp_path):
    run = SupervisedRun([TALKER], tmp_path, on_death='restart')
    first: list[int] = []

    def replaced() -> bool:
        pid = run.supervisor.pids['talker']
        if not first:
            first.append(pid)
            os.kill(pid, signal.SIGKILL)
        return pid != first[0]

    assert run.until(replaced) == 0
    assert 'talker was killed by SIGKILL' in run.reports[0]
    assert not any(map(alive, run.pids))


@pytest.mark.parametrize('hang', ['stopped', 'in a callback'])
def test_a_hung_node_is_killed_and_replaced(hang, tmp_path):
    spec = TALKER if hang == 'stopped' else HANGING
    run = SupervisedRun([spec], tmp_path, on_death='restart', hung_after_s=2.0)
    first: list[int] = []

    def replaced() -> bool:
        (process,) = run.supervisor._processes
        if process.beats and not first:
            first.append(process.popen.pid)
            if hang == 'stopped':
                process.send_signal(signal.SIGSTOP)
        return bool(first) and process.popen.pid != first[0]

    assert run.until(replaced) == 0
    assert re.search(
        r'talker was hung, without a heartbeat for \d+ s, and was killed', run.reports[0]
    )
    assert ('in publish_text' in run.reports[0]) == (hang == 'in a callback'), 'where it hung'
    assert not any(map(alive, run.pids))


def test_a_hung_node_ends_a_graph_that_restarts_nothing(tmp_path):
    run = SupervisedRun([HANGING], tmp_path, hung_after_s=2.0)
    assert run.until(lambda: False) == 1
    assert 'was hung' in run.reports[0]
    assert not any(map(alive, run.pids))


def test_a_node_that_never_comes_to_life_is_hung(tmp_path, monkeypatch):
    monkeypatch.setattr(node_process, 'START_LIMIT_S', 2.0)
    run = SupervisedRun([STUBBORN], tmp_path)
    assert run.until(lambda: False) == 1
    assert 'stubborn was hung' in run.reports[-1]
    assert not any(map(alive, run.pids))


def test_a_node_of_another_package_may_be_without_a_heartbeat(tmp_path, monkeypatch):
    monkeypatch.setattr(node_process, 'START_LIMIT_S', 1.0)
    other = replace(STUBBORN, has_heartbeat=False)
    run = SupervisedRun([other], tmp_path, patience_s=0.3)
    end = time.monotonic() + 3.0
    assert run.until(lambda: time.monotonic() > end) == 0


def test_a_halt_of_the_supervisor_makes_no_node_hung(tmp_path):
    run = SupervisedRun([TALKER], tmp_path, hung_after_s=3.0)
    ticks = 0

    def halted_with_its_nodes() -> bool:
        nonlocal ticks
        (process,) = run.supervisor._processes
        if process.beats and ticks == 0:
            ticks = 1
            pid = process.popen.pid
            os.kill(pid, signal.SIGSTOP)
            time.sleep(4.0)
            os.kill(pid, signal.SIGCONT)
        ticks += ticks > 0
        return ticks > 50

    assert run.until(halted_with_its_nodes) == 0
    assert run.reports == []


def test_a_node_that_dies_at_every_start_is_given_up(tmp_path):
    run = SupervisedRun([CRASHER], tmp_path, on_death='restart')
    assert run.until(lambda: False) == 1
    assert len(run.pids) == 3
    assert sum('restarting it' in line for line in run.reports) == 2
    assert 'died 3 times' in run.reports[-1]


def test_a_node_that_ignores_signals_is_killed_in_the_end(tmp_path):
    run = SupervisedRun([STUBBORN], tmp_path, patience_s=0.3)
    assert run.until(lambda: 'here I stand' in run.log('stubborn', tmp_path)) == 0
    assert [line for line in run.reports if 'did not end' in line] == [
        'stubborn did not end on SIGINT', 'stubborn did not end on SIGTERM'
    ]  # fmt: skip
    assert not any(map(alive, run.pids))


def test_an_error_that_a_node_logs_is_shown_once(tmp_path):
    run = SupervisedRun([STUBBORN], tmp_path, patience_s=0.1)
    ticks_after = 0

    def shown_and_read_again() -> bool:
        nonlocal ticks_after
        ticks_after += any('here I stand' in line for line in run.reports)
        return ticks_after > 5

    assert run.until(shown_and_read_again) == 0
    assert sum('here I stand' in line for line in run.reports) == 1


def test_a_bad_parameter_gives_one_sentence(tmp_path):
    run = SupervisedRun([NodeSpec('dummy_nodes', 'talker', {'text': 'bad'})], tmp_path)
    assert run.until(lambda: False) == 1
    [report] = run.reports
    assert 'exit code 2' in report
    assert 'error: talker: parameter text = bad cannot be used' in report
    assert 'Traceback' not in report


SUPERVISING = """
import sys, time
from pathlib import Path
from ja_runner import node_process
from ja_runner.node_spec import NodeSpec
from ja_runner.supervisor import Supervision, Supervisor
graph = [NodeSpec('dummy_nodes', 'talker'), NodeSpec('dummy_nodes', 'stubborn')]
supervisor = Supervisor(
    graph, Path(sys.argv[1]), Supervision(patience_s=0.3), report=lambda _: None
)
shown = False
def tick():
    global shown
    if not shown and 'here I stand' in (Path(sys.argv[1]) / 'stubborn.log').read_text():
        shown = True
        print(*supervisor.pids.values(), flush=True)
    time.sleep(0.01)
sys.exit(supervisor.run(tick))
"""


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_orphans_however_the_supervisor_ends(number, tmp_path):
    process = subprocess.Popen(
        [sys.executable, '-c', SUPERVISING, str(tmp_path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    pids = [int(word) for word in process.stdout.readline().split()]
    assert len(pids) == 2
    assert all(map(alive, pids))
    process.send_signal(number)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == (-number if number == signal.SIGKILL else 0)
    assert errors == ''
    wait_for(lambda: not any(map(alive, pids)))
