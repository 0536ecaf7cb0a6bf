"""Faults on hosts of their own: command lines and results here, real namespaces if root asks."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ja_common.python_command import module_command
from ja_diagnostics.faults import hosts
from ja_diagnostics.faults.hosts import (
    CASES,
    host_command,
    missing,
    place_on_host,
    read_outcome,
    run_on_hosts,
    write_outcome,
)
from ja_diagnostics.faults.run import FaultOutcome
from ja_runner.graph import sim_graph

OUTCOME = FaultOutcome('network to the learner cut', True, 0.15, None, (0, 1))


def completed(returncode: int, stderr: str = '') -> subprocess.CompletedProcess:
    return subprocess.CompletedProcess([], returncode, '', stderr)


@pytest.fixture
def host_that(monkeypatch: pytest.MonkeyPatch):
    """Return a function that replaces the host by a Python program with the folder as argv[1]."""

    def replace_host(program: str) -> None:
        def command(_: str, folder: Path) -> list[str]:
            return [sys.executable, '-c', program, str(folder)]

        monkeypatch.setattr(hosts, 'host_command', command)

    return replace_host


def test_there_are_cases_for_the_network_an_intruder_and_the_segments():
    assert list(CASES) == ['network', 'intruder', 'segments']
    assert all(map(callable, CASES.values()))


def test_tools_that_are_not_installed_are_named(monkeypatch):
    there = shutil.which
    monkeypatch.setattr(shutil, 'which', lambda tool: None if tool == 'ip' else there(tool))
    assert missing().startswith('ip not found')


@pytest.mark.parametrize('allowed', [True, False])
def test_hosts_need_the_right_to_make_namespaces(allowed, monkeypatch):
    tried = []

    def run(command, **_):
        tried.append(command)
        return completed(0) if allowed else completed(1, 'unshare failed: Not permitted\n')

    monkeypatch.setattr(shutil, 'which', lambda tool: f'/usr/bin/{tool}')
    monkeypatch.setattr(subprocess, 'run', run)
    assert missing() == ('' if allowed else 'unshare failed: Not permitted (needs root)')
    assert tried == [['unshare', '--net', '--mount', 'true']]


def test_a_host_has_a_network_and_mounts_of_its_own(tmp_path):
    unshare, python = host_command('network', tmp_path)[:3], host_command('network', tmp_path)[3:]
    assert unshare == ['unshare', '--net', '--mount']
    assert python == module_command('ja_diagnostics.faults.hosts', 'network', str(tmp_path))


def test_one_node_runs_in_the_namespaces_of_the_other_host():
    graph = sim_graph()
    placed = place_on_host(graph, 'learning_module', 4711)
    changed = [(a, b) for a, b in zip(graph, placed, strict=True) if a.command() != b.command()]
    [(near, far)] = changed
    assert near.executable == 'learning_module'
    enter = ['nsenter', '--target=4711', '--net', '--mount', '--']
    assert far.command() == [*enter, *near.command()]


def test_an_outcome_is_read_as_it_was_written(tmp_path):
    write_outcome(OUTCOME, tmp_path)
    assert read_outcome(tmp_path) == OUTCOME


def test_the_outcome_and_the_lines_of_a_host_arrive(host_that, tmp_path):
    host_that(
        'import sys; from pathlib import Path\n'
        'from ja_diagnostics.faults.hosts import write_outcome\n'
        'from ja_diagnostics.faults.run import FaultOutcome\n'
        'print("two lines\\nof progress", flush=True)\n'
        f'write_outcome({OUTCOME!r}, Path(sys.argv[1]))'
    )
    lines: list[str] = []
    assert run_on_hosts('network', tmp_path / 'new', lines.append) == OUTCOME
    assert lines == ['two lines', 'of progress']


def test_a_host_that_fails_is_an_error_with_its_exit_code(host_that, tmp_path):
    host_that('import sys; sys.exit(3)')
    with pytest.raises(OSError, match='segments: the host ended with exit code 3'):
        run_on_hosts('segments', tmp_path / 'new', print)


@pytest.mark.slow
@pytest.mark.skipif(os.geteuid() != 0, reason='namespaces of network and mounts need root')
@pytest.mark.parametrize('case', CASES)
def test_head_stops_and_goes_on_on_hosts_of_its_own(case, tmp_path):
    assert missing() == ''
    lines: list[str] = []
    outcome = run_on_hosts(case, tmp_path / case, lines.append)
    assert outcome.ok, (outcome, lines)
