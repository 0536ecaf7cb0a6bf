"""The packages as a rig builds them: `colcon build`, then an executable of the install tree."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

from rclpy.node import Node

from ja_common.executor import CachedWaitSetExecutor
from ros_testing import spin_until

SOURCES = Path(__file__).parents[2] / 'ros2_ws' / 'src'
IN_WORKSPACE = 'source install/setup.bash && exec "$@"'


def test_a_node_of_the_built_workspace_runs(tmp_path, ros_context):
    colcon = shutil.which('colcon', path=Path(sys.executable).parent)
    assert colcon, 'colcon is not installed beside this Python'
    environ = {**os.environ, 'PATH': f'{Path(colcon).parent}:{os.environ["PATH"]}'}
    built = subprocess.run(
        [colcon, 'build', '--base-paths', str(SOURCES)],
        cwd=tmp_path, env=environ, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert built.returncode == 0, built.stdout + built.stderr

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
        errors = gate.communicate(timeout=10)[1]
        executor.shutdown()
        watcher.destroy_node()
    assert gate.returncode == 0
    assert 'Traceback' not in errors


def _data(package: Path) -> set[str]:
    """Relative paths of all the files that are not Python's, nor its caches'."""
    return {
        str(path.relative_to(package))
        for path in package.rglob('*')
        if path.is_file() and path.suffix != '.py' and '__pycache__' not in path.parts
    }
