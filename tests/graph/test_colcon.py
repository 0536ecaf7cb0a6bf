"""The packages as a rig builds them: `colcon build`, an executable of it, and `colcon test`."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rclpy.node import Node

from ja_common.executor import CachedWaitSetExecutor
from ros_testing import PATIENCE_S, spin_until

SOURCES = Path(__file__).parents[2] / 'ros2_ws' / 'src'
IN_WORKSPACE = 'source install/setup.bash && exec "$@"'


# Of all packages, the quickest tests; test_manifests.py compares the setup.cfg of the others.
TESTED = ('ja_control', 'ja_runner')


@pytest.fixture
def environ(domain: int) -> dict[str, str]:
    """Return an environment in which colcon starts this Python, in the test's own domain."""
    return {**os.environ, 'PATH': f'{Path(sys.executable).parent}:{os.environ["PATH"]}'}


def colcon(folder: Path, environ: dict[str, str], verb: str, *options: str) -> None:
    """Run colcon on our packages, with build/ and install/ in the folder; fail if it fails."""
    command = shutil.which('colcon', path=Path(sys.executable).parent)
    assert command, 'colcon is not installed beside this Python'
    done = subprocess.run(
        [command, verb, '--base-paths', str(SOURCES), *options],
        cwd=folder, env=environ, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_node_of_the_built_workspace_runs(tmp_path, environ, ros_context):
    colcon(tmp_path, environ, 'build')

    install = tmp_path / 'install'
    sourced = ['bash', '-c', IN_WORKSPACE, 'bash']
    for package in (path.name for path in SOURCES.iterdir()):
        marker = install / package / 'share/ament_index/resource_index/packages' / package
        assert marker.exists()
        look = f'import {package}; print({package}.__file__)'
        found = subprocess.check_output([*sourced, sys.executable, '-c', look], cwd=tmp_path)
        assert found.decode().startswith(str(install))
        assert _data(SOURCES / package / package) <= _data(Path(found.decode()).parent)

    watcher = Node('watcher', context=ros_context)
    executor = CachedWaitSetExecutor(context=ros_context)
    executor.add_node(watcher)
    # Where `ros2 run ja_control gate` looks, and what it starts.
    executable = install / 'ja_control' / 'lib' / 'ja_control' / 'gate'
    gate = subprocess.Popen(
        [*sourced, str(executable), '--ros-args', '-r', '__ns:=/built'],
        cwd=tmp_path, env=environ, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        spin_until(executor, lambda: ('gate', '/built') in watcher.get_node_names_and_namespaces())
    finally:
        gate.send_signal(signal.SIGINT)
        errors = gate.communicate(timeout=PATIENCE_S)[1]
        executor.shutdown()
        watcher.destroy_node()
    assert gate.returncode == 0
    assert 'Traceback' not in errors


@pytest.mark.slow
def test_colcon_runs_the_tests_of_a_package(tmp_path, environ):
    colcon(tmp_path, environ, 'build', '--packages-up-to', *TESTED)
    selected = ('--packages-select', *TESTED)
    colcon(tmp_path, environ, 'test', *selected, '--return-code-on-test-failure')
    for package in TESTED:
        [suite] = ElementTree.parse(tmp_path / 'build' / package / 'pytest.xml').getroot()
        files = list((SOURCES.parents[1] / 'tests' / package).glob('test_*.py'))
        assert int(suite.get('tests')) > len(files)
        assert suite.get('failures') == suite.get('errors') == '0'


def _data(package: Path) -> set[str]:
    """Return the relative paths of all files that are neither Python's nor its caches'."""
    return {
        str(path.relative_to(package))
        for path in package.rglob('*')
        if path.is_file() and path.suffix != '.py' and '__pycache__' not in path.parts
    }
