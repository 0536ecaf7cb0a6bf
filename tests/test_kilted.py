"""The nodes and a demo run on ROS 2 Kilted, whose wheels `./ja` installs into an environment.

The environment is made from the lock files, in a checkout of its own whose folders are links.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from bootstrap.machine import clean_environ
from ja_common.ros_defaults import ENVIRONMENT

ROOT = Path(__file__).parent.parent
LINKS = ('bootstrap', 'docs', 'pyproject.toml', 'requirements', 'ros2_ws', 'tests', 'tools')

pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def checkout() -> Iterator[Path]:
    """Yield a checkout without an environment."""
    # Not tmp_path: pytest would keep three of these environments.
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder)
        for name in LINKS:
            (made / name).symlink_to(ROOT / name)
        shutil.copy(ROOT / 'ja', made / 'ja')
        yield made


def run_ja(checkout: Path, *arguments: str, timeout_s: float = 3600.0) -> str:
    """Run `./ja` with Kilted and without this process's settings; return its output, or fail."""
    ours = {'PYTHONPATH', 'ROS_DISTRO', 'JA_WITHOUT', *ENVIRONMENT}
    environ = {k: v for k, v in clean_environ(os.environ).items() if k not in ours}
    environ |= {'JA_ROS_DISTRO': 'kilted', 'JA_PYTHON': sys.executable}
    done = subprocess.run(
        [sys.executable, checkout / 'ja', *arguments],
        cwd=checkout, env=environ, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        timeout=timeout_s, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-8000:]
    return done.stdout


def test_the_environment_has_kilted(checkout: Path) -> None:
    assert 'Usage' in run_ja(checkout, '--help')
    look = "from importlib import metadata; print(metadata.version('ros-kilted-rclpy'))"
    python = checkout / '.venv' / 'bin' / 'python'
    found = subprocess.run([python, '-c', look], capture_output=True, text=True, check=True)
    assert found.stdout.startswith('9.')


@pytest.mark.parametrize(
    'tests',
    [
        'ja_common/test_rclpy_private.py',
        *('ja_common', 'ja_control', 'ja_learning', 'ja_perception', 'ja_recording', 'ja_runner'),
    ],
)
def test_the_tests_of_the_nodes_pass(checkout: Path, tests: str) -> None:
    options = ['-q', '-p', 'no:cacheprovider', '--tb=short']
    assert ' passed' in run_ja(checkout, 'test', *options, f'tests/{tests}')


def test_a_demo_runs(checkout: Path, domain: int) -> None:
    options = ['--trials', '3', '--exam', '0', '--time', '60', '--no-view']
    output = run_ja(checkout, 'demo', *options, timeout_s=600.0)
    assert 'success, practice' in output
