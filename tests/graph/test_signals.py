"""SIGINT and SIGTERM at any instant: nothing is interrupted, nothing stays behind or is broken."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from ja_learning.core.checkpoint import load_checkpoint
from ja_runner.node_process import NodeProcess
from ja_runner.node_spec import NodeSpec
from ros_testing import PATIENCE_S

pytestmark = pytest.mark.usefixtures('domain')

STOPS = (signal.SIGINT, signal.SIGTERM)
# Nothing that a node writes on its way, and nothing that Python writes about it.
WRONG = ('Traceback', 'Error', 'Exception', 'exception', 'Fatal', 'terminate called')


def check_log(text: str) -> None:
    assert not any(word in text for word in WRONG), text


def end_at_random(random_: random.Random, spec: NodeSpec, log: Path, latest_s: float) -> None:
    """Start a node, send it one or two signals at a random instant, and look at what is left."""
    process = NodeProcess(spec, log)
    try:
        time.sleep(random_.uniform(0, latest_s))
        process.send_signal(random_.choice(STOPS))
        if random_.random() < 0.3:
            time.sleep(random_.uniform(0, 0.3))
            process.send_signal(random_.choice(STOPS))
        process.popen.wait(timeout=PATIENCE_S)
    finally:
        process.send_signal(signal.SIGKILL)
        process.close()
    check_log(log.read_text())


def end_demo_at_random(random_: random.Random, folder: Path, latest_s: float) -> None:
    """Start a demo, send it a signal at a random instant, and look at what is left."""
    demo = subprocess.Popen(
        [sys.executable, '-m', 'ja_bringup', 'demo', '--no-view'],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        env={**os.environ, 'JA_TEST_OF_SIGNALS': str(folder)},
    )  # fmt: skip
    time.sleep(random_.uniform(0.5, latest_s))
    demo.send_signal(random_.choice(STOPS))
    output, _ = demo.communicate(timeout=PATIENCE_S)
    check_log(output + '\n'.join(path.read_text() for path in folder.glob('runs/*/log/*.log')))
    assert 'did not end on' not in output
    assert processes_with_environment('JA_TEST_OF_SIGNALS', str(folder)) == []
    for checkpoint in folder.glob('runs/*/checkpoints/*.npz'):
        load_checkpoint(checkpoint)


def processes_with_environment(name: str, value: str) -> list[str]:
    found = []
    for process in psutil.process_iter():
        try:
            if process.environ().get(name) == value:
                found.append(' '.join(process.cmdline()))
        except psutil.Error:
            continue
    return found


@pytest.mark.parametrize('node', ['gate', 'learning_module'])
def test_a_node_ends_at_any_instant(node, tmp_path):
    random_ = random.Random(node)
    spec = NodeSpec({'gate': 'ja_control'}.get(node, 'ja_learning'), node)
    for i in range(4):
        end_at_random(random_, spec, tmp_path / f'{i}.log', latest_s=4.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('package', 'node'),
    [
        ('ja_sim', 'sim'),
        ('ja_perception', 'salient_feature_detector'),
        ('ja_control', 'visual_feedback_controller'),
        ('ja_control', 'gate'),
        ('ja_learning', 'internal_evaluator'),
        ('ja_learning', 'learning_module'),
        ('ja_recording', 'recorder'),
        ('ja_dashboard', 'view'),
    ],
)
def test_each_node_ends_at_any_of_twenty_instants(package, node, tmp_path):
    random_ = random.Random(node)
    parameters = {'recorder': {'folder': str(tmp_path)}, 'view': {'port': 0}}.get(node, {})
    spec = NodeSpec(package, node, parameters)
    for i in range(20):
        end_at_random(random_, spec, tmp_path / f'{i}.log', latest_s=5.0)


@pytest.mark.slow
def test_a_demo_ends_at_any_of_forty_instants(tmp_path):
    random_ = random.Random(0)
    for i in range(40):
        folder = tmp_path / str(i)
        folder.mkdir()
        end_demo_at_random(random_, folder, latest_s=20.0)
