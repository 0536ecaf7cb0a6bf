"""The nodes and the commands run with the libraries of Ubuntu 24.04, of requirements/.

An environment of Python 3.12 is made for it, of several GB where pip brings the CUDA of torch.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from bootstrap.machine import clean_environ, probe_python
from bootstrap.plan import PARTS
from ja_common.ros_defaults import ENVIRONMENT
from library_names import NEWER_NAMES, names_of_other_python, text_of_newer_names

ROOT = Path(__file__).parent.parent
REQUIREMENTS = ROOT / 'requirements'
# The simulator is for the demo. The page and the experiments are not of a rig.
LEFT_OUT = {package for part in ('dashboard', 'experiments') for package in PARTS[part]}
PACKAGES = [
    path.parent
    for path in sorted((ROOT / 'ros2_ws' / 'src').glob('*/setup.py'))
    if path.parent.name not in LEFT_OUT
]

pytestmark = pytest.mark.slow


def python_3_12() -> str | None:
    """Return a Python 3.12: this one, one of PATH, or one of pyenv, which may not be active."""
    pyenv = Path(os.environ.get('PYENV_ROOT', Path.home() / '.pyenv')) / 'versions'
    others = (str(path) for path in pyenv.glob('3.12.*/bin/python3.12'))
    for command in (sys.executable, 'python3.12', *others):
        python = probe_python(command, os.environ)
        if python and python.version == (3, 12) and python.has_ensurepip:
            return python.executable
    return None


@pytest.fixture(scope='module')
def folder() -> Iterator[Path]:
    # Not tmp_path: pytest would keep three of these environments.
    with tempfile.TemporaryDirectory() as made:
        yield Path(made)


@pytest.fixture(scope='module')
def ubuntu(folder: Path) -> Path:
    """Return the `bin` of an environment with our packages and the libraries of Ubuntu 24.04."""
    python = python_3_12()
    if python is None:
        pytest.skip('there is no Python 3.12 with its venv: the Python of Ubuntu 24.04')
    # Ubuntu's OpenCV has the contrib modules.
    base = (REQUIREMENTS / 'base.in').read_text()
    assert 'opencv-python-headless' in base
    required = folder / 'base.in'
    required.write_text(base.replace('opencv-python-headless', 'opencv-contrib-python-headless'))

    run([python, '-m', 'venv', folder / 'venv'])
    bin_folder = folder / 'venv' / 'bin'
    pip = [bin_folder / 'python', '-m', 'pip', 'install', '--disable-pip-version-check']
    files = [part for name in ('ros.in', 'sim.in') for part in ('-r', REQUIREMENTS / name)]
    constraints = REQUIREMENTS / 'ubuntu-24.04.txt'
    run([*pip, '-c', constraints, '-r', required, *files, 'pytest', 'hypothesis'])
    ours = [part for package in PACKAGES for part in ('-e', package)]
    compat = ('--config-settings', 'editable_mode=compat')
    run([*pip, '--no-deps', '--no-build-isolation', '--use-pep517', *compat, *ours])
    return bin_folder


def run(command: list[str | Path], cwd: Path = ROOT, timeout_s: float = 1800.0) -> str:
    """Run a command without this process's path and ROS defaults; return its output, or fail."""
    ours = {'PYTHONPATH', *ENVIRONMENT}
    environ = {k: v for k, v in clean_environ(os.environ).items() if k not in ours}
    done = subprocess.run(
        list(map(str, command)),
        cwd=cwd, env=environ, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        timeout=timeout_s, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-8000:]
    return done.stdout


def test_the_libraries_are_those_of_ubuntu(ubuntu: Path) -> None:
    look = 'import cv2, numpy, scipy; print(cv2.__version__, numpy.__version__, scipy.__version__)'
    assert run([ubuntu / 'python', '-c', look]).split() == ['4.6.0', '1.26.4', '1.11.4']


def test_the_list_of_newer_names_is_right(ubuntu: Path) -> None:
    expected = text_of_newer_names(names_of_other_python(str(ubuntu / 'python')))
    assert NEWER_NAMES.read_text() == expected, 'write it again: see library_names.py'


@pytest.mark.parametrize(
    'tests',
    [
        *('ja_common', 'ja_control', 'ja_learning', 'ja_perception'),
        *('ja_recording/test_export.py', 'test_worked_examples.py'),
    ],
)
def test_the_tests_of_the_nodes_pass(ubuntu: Path, tests: str) -> None:
    command = [ubuntu / 'python', '-m', 'pytest', '-q', '-p', 'no:cacheprovider', '--tb=short']
    assert ' passed' in run([*command, ROOT / 'tests' / tests])


def test_every_command_explains_itself(ubuntu: Path) -> None:
    assert 'demo' in run([ubuntu / 'ja', '--help'])
    for command in ('demo', 'rig', 'record', 'replay', 'export', 'doctor', 'calibrate', 'topics'):
        assert 'Usage' in run([ubuntu / 'ja', command, '--help'])


def test_a_demo_runs(ubuntu: Path, folder: Path, domain: int) -> None:
    options = ['--trials', '3', '--exam', '0', '--time', '60', '--no-view']
    output = run([ubuntu / 'ja', 'demo', *options], cwd=folder, timeout_s=300.0)
    assert 'success, practice' in output
    assert list(folder.glob('runs/*-demo/success_curve.png'))
