"""A demo over two hosts: the learner behind a bad cable, and all else at the head."""

import os
import subprocess
import sys

import pytest

from ja_diagnostics.faults import hosts
from ja_diagnostics.faults.cable import TUN
from ros_testing import PATIENCE_S

pytestmark = pytest.mark.slow
WHY_NOT = hosts.missing() or ('' if TUN.exists() else f'no {TUN}')

NEAR = """
import signal, subprocess, sys
from ja_diagnostics.faults import hosts
from ja_diagnostics.faults.cable import Impairment, lay_cable

ROS = ['--ros-args', '-p', 'lockstep:=false']
JA = [sys.executable, '-m', 'ja_bringup', 'demo', '--no-view', *ROS]
hosts.prepare_host()
with lay_cable(Impairment(0.02, 0.05)) as cable, hosts.far_host(hosts.move_far_end) as host:
    hosts.set_discovery_range('SUBNET')
    enter = ['nsenter', f'--target={host}', '--net', '--mount', '--']
    options = ['--', '--only', 'learning_module']
    with open('desktop.log', 'w') as log:
        desktop = subprocess.Popen([*enter, *JA, *options], stdout=log, stderr=log)
    options = ['--', '--without', 'learning_module', '--trials', '3', '--exam', '0']
    head = subprocess.run([*JA, *options], capture_output=True, text=True)
    runs_on = desktop.poll() is None
    desktop.send_signal(signal.SIGINT)
    print(head.returncode, runs_on, desktop.wait(60))
    print(head.stdout, head.stderr)
"""


@pytest.mark.usefixtures('domain')
@pytest.mark.skipif(WHY_NOT != '', reason=WHY_NOT)
def test_two_machines_run_a_part_of_the_demo_each(tmp_path):
    command = ['unshare', '--net', '--mount', sys.executable, '-c', NEAR]
    ran = subprocess.run(
        command, capture_output=True, text=True, timeout=PATIENCE_S, env=os.environ,
        cwd=tmp_path, check=False,
    )  # fmt: skip
    first, _, rest = ran.stdout.partition('\n')
    assert first == '0 True 0', (ran, (tmp_path / 'desktop.log').read_text())
    assert 'success, practice' in rest
