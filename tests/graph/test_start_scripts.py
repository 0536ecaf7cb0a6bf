"""`./ja demo` and `./ja rig` as people use them: run to the end, interrupted, broken."""

import csv
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from urllib.error import URLError
from urllib.request import urlopen

import cv2
import numpy as np
import psutil
import pytest

from ja_learning.core.checkpoint import load_checkpoint
from ros_testing import PATIENCE_S

pytestmark = pytest.mark.usefixtures('domain')


def start(folder: Path, *args: str, view: bool = False) -> subprocess.Popen:
    command, *options = args
    if not view:
        options = ['--no-view', *options]
    return subprocess.Popen(
        [sys.executable, '-m', 'ja_bringup.cli', command, *options],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip


def processes_of(parent: int) -> list[int]:
    """Return the ids of the processes that a process has started."""
    return [child.pid for child in psutil.Process(parent).children()]


def named(pids: list[int]) -> dict[str, int]:
    """Return process ids by the module of their node; one that starts or ends has no name."""
    modules = {}
    for pid in pids:
        with suppress(psutil.Error):
            command = psutil.Process(pid).cmdline()
            if 'ja_runner.child' in command:
                modules[command[command.index('ja_runner.child') + 1]] = pid
    return modules


def logs(folder: Path) -> str:
    return '\n'.join(path.read_text() for path in folder.glob('runs/*/log/*.log'))


@pytest.mark.parametrize(
    'options', [['--exam', '2'], ['--exam', '0', '--one-process']], ids=['many', 'one']
)
def test_the_demo_runs_to_its_end(options, tmp_path):
    process = start(tmp_path, 'demo', '--trials', '3', *options)
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, output
    assert 'Traceback' not in output + logs(tmp_path)
    assert 'practice, last trials' in output
    [curve] = tmp_path.glob('runs/*-demo/success_curve.csv')
    rows = list(csv.DictReader(curve.open()))
    assert len(rows) >= 3
    assert [int(row['trial']) for row in rows] == list(range(1, len(rows) + 1))
    picture = cv2.imread(str(curve.with_suffix('.png')))
    assert picture is not None
    assert picture.std() > 5
    assert (curve.parent / 'checkpoints' / 'last.npz').exists()
    assert int((curve.parent / 'trials').read_text()) >= 3


def test_a_run_that_left_nothing_cannot_be_resumed(tmp_path):
    process = start(tmp_path, 'demo', '--resume', 'runs')
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 2
    assert output == 'error: runs cannot be resumed: there is no checkpoint in runs/checkpoints\n'


@pytest.mark.slow
def test_a_demo_is_resumed_where_it_ended(tmp_path):
    first = start(tmp_path, 'demo', '--trials', '10', '--exam', '0', '--one-process')
    output, _ = first.communicate(timeout=PATIENCE_S)
    assert first.returncode == 0, output
    [run] = tmp_path.glob('runs/*-demo')
    trials = int((run / 'trials').read_text())
    learned = trials_learned(run)

    options = ['--trials', '5', '--exam', '0', '--resume', str(run)]
    second = start(tmp_path, 'demo', *options)
    output, _ = second.communicate(timeout=PATIENCE_S)
    assert second.returncode == 0, output
    assert f'goes on from {run / "checkpoints"}' in logs(tmp_path)
    assert int((run / 'trials').read_text()) >= trials + 5
    assert trials_learned(run) > learned


def trials_learned(run: Path) -> int:
    return load_checkpoint(run / 'checkpoints' / 'last.npz')[1]['trials']


def wait_for_log(
    folder: Path, process: subprocess.Popen, timeout_s: float = PATIENCE_S
) -> list[int]:
    """Wait until every node of the graph runs as a process; return their ids."""
    end = time.monotonic() + timeout_s
    while (
        len(list(folder.glob('runs/*/log/*.log'))) < 7 or len(named(processes_of(process.pid))) < 7
    ):
        assert process.poll() is None, process.communicate()[0]
        assert time.monotonic() < end
        time.sleep(0.05)
    return processes_of(process.pid)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_the_demo_cleanly_even_while_it_starts(number, tmp_path):
    process = start(tmp_path, 'demo')
    pids = wait_for_log(tmp_path, process)
    process.send_signal(number)
    output, _ = process.communicate(timeout=PATIENCE_S)
    # Code 0 promises a finished trial.
    assert process.returncode == int('no trial was finished' in output), output
    assert 'Traceback' not in output + logs(tmp_path)
    assert not [pid for pid in pids if psutil.pid_exists(pid)]


def test_a_killed_node_ends_the_demo_with_its_name(tmp_path):
    process = start(tmp_path, 'demo')
    pids = wait_for_log(tmp_path, process)
    os.kill(named(pids)['ja_learning.learning_module_node'], signal.SIGKILL)
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert 'learning_module was killed by SIGKILL' in output
    assert 'Traceback' not in output + logs(tmp_path)
    assert not [pid for pid in pids if psutil.pid_exists(pid)]


def test_a_bad_parameter_file_gives_one_clear_error(tmp_path):
    bad = tmp_path / 'bad.yaml'
    bad.write_text('/**:\n  ros__parameters:\n    max_shifts: many\n')
    process = start(tmp_path, 'demo', '--ros-args', '--params-file', str(bad))
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert '/gate: ' in output
    assert "max_shifts = 'many' is a str" in output
    assert 'Traceback' not in output


def test_a_missing_parameter_file_is_named(tmp_path):
    process = start(tmp_path, 'demo', '--ros-args', '--params-file', 'nowhere.yaml')
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 2
    assert 'nowhere.yaml' in output
    assert 'Traceback' not in output


def test_the_live_page_is_served_beside_the_graph_and_ends_with_it(tmp_path):
    process = start(tmp_path, 'demo', view=True)
    lines = iter(process.stdout.readline, '')
    address = next(line for line in lines if 'live page: ' in line).split('live page: ')[1].strip()
    page = wait_for_page(address)
    assert 'Joint attention' in page
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == int('no trial was finished' in output), output
    assert 'Traceback' not in output + logs(tmp_path)
    with pytest.raises(URLError):
        urlopen(address, timeout=1)


def wait_for_page(address: str, timeout_s: float = PATIENCE_S) -> str:
    end = time.monotonic() + timeout_s
    while True:
        try:
            return urlopen(address, timeout=timeout_s).read().decode()
        except URLError:
            assert time.monotonic() < end
            time.sleep(0.1)


@pytest.mark.parametrize('composition', [[], ['--one-process']], ids=['many', 'one'])
def test_the_rig_runs_on_a_folder_of_images(composition, tmp_path):
    pictures = tmp_path / 'pictures'
    pictures.mkdir()
    picture = np.full((480, 640, 3), 90, np.uint8)
    cv2.circle(picture, (400, 200), 40, (0, 0, 255), -1)
    cv2.imwrite(str(pictures / 'a.png'), picture)
    process = start(tmp_path, 'rig', '--source', str(pictures), '--time', '1', *composition)
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, output
    assert 'Traceback' not in output + logs(tmp_path)
