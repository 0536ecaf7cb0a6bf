"""A rig on its own topics starts without the simulator, the live page and the experiments."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from rclpy.context import Context
from rclpy.node import Node
from std_msgs.msg import Header

from bootstrap.plan import PARTS
from ja_common.executor import CachedWaitSetExecutor
from ja_common.image_codec import encode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.topics import DETECTIONS, IMAGE, JOINT_STATES
from ja_runner.graph import rig_graph
from ja_runner.parts import PART_OF
from ros_testing import PATIENCE_S, spin_until

OUR_PACKAGES = [package for packages in PARTS.values() for package in packages]
LIBRARIES = ['mujoco', 'gymnasium', 'nicegui', 'fastapi', 'uvicorn', 'distributed']
# Python imports a module of this name at its start, in every process.
BLOCKER = f"""
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.partition('.')[0] in {[*OUR_PACKAGES, *LIBRARIES]!r}:
            raise ModuleNotFoundError(f'No module named {{name!r}} (blocked)', name=name)

sys.meta_path.insert(0, Blocker())
"""


@pytest.fixture
def environ(domain: int, tmp_path: Path) -> dict[str, str]:
    """Return an environment whose Pythons do not find the parts that a rig may leave out."""
    folder = tmp_path / 'blocker'
    folder.mkdir()
    (folder / 'sitecustomize.py').write_text(BLOCKER)
    path = [str(folder), *filter(None, [os.environ.get('PYTHONPATH')])]
    return {**os.environ, 'PYTHONPATH': os.pathsep.join(path)}


def ja(environ: dict[str, str], folder: Path, *args: str) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, '-m', 'ja_bringup.cli', *args],
        cwd=folder, env=environ, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip


class FakeRig(Node):
    """A head that stands still before a grey wall: images and joint states at 20 Hz."""

    def __init__(self, context: Context) -> None:
        super().__init__('fake_rig', context=context)
        self.detections = 0
        self._image = np.full((120, 160, 3), 90, np.uint8)
        self._codec = JointCodec(JointConfig())
        self._images = self.create_publisher(IMAGE.type, IMAGE.name, IMAGE.publisher_qos)
        self._joints = self.create_publisher(
            JOINT_STATES.type, JOINT_STATES.name, JOINT_STATES.publisher_qos
        )
        self.create_subscription(
            DETECTIONS.type, DETECTIONS.name, self._count_detections, DETECTIONS.subscriber_qos
        )
        self.create_timer(0.05, self._publish)

    def _publish(self) -> None:
        header = Header(stamp=self.get_clock().now().to_msg(), frame_id='camera')
        self._joints.publish(self._codec.encode_posture(header, np.zeros(2), np.zeros(2)))
        self._images.publish(encode_image(self._image, header.stamp, 'camera'))

    def _count_detections(self, _: object) -> None:
        self.detections += 1


@pytest.fixture
def fake_rig(ros_context: Context) -> Iterator[tuple[FakeRig, CachedWaitSetExecutor]]:
    """Return the fake rig and the executor that runs it."""
    rig = FakeRig(ros_context)
    executor = CachedWaitSetExecutor(context=ros_context)
    executor.add_node(rig)
    yield rig, executor
    executor.shutdown()
    rig.destroy_node()


def test_the_blocked_packages_are_the_parts():
    assert set(OUR_PACKAGES) == set(PART_OF)
    assert {part for part, packages in PARTS.items() for _ in packages} == set(PART_OF.values())


@pytest.mark.parametrize('options', [['--no-view'], ['--one-process']], ids=['many', 'one'])
def test_all_nodes_of_a_rig_start_and_process_images(options, environ, fake_rig, tmp_path):
    rig, executor = fake_rig
    expected = {node.executable for node in rig_graph()}
    process = ja(environ, tmp_path, 'rig', '--time', '4', *options)
    seen: set[str] = set()

    def all_started() -> bool:
        seen.update(rig.get_node_names())
        assert process.poll() is None, process.communicate()[0]
        return expected <= seen and rig.detections > 3

    try:
        spin_until(executor, all_started)
        spin_until(executor, lambda: process.poll() is not None)
    finally:
        process.kill()
        output, _ = process.communicate()
    assert process.returncode == 0, output
    logs = ''.join(path.read_text() for path in tmp_path.glob('runs/*/log/*.log'))
    assert 'Traceback' not in output + logs
    assert ('there is no live page' in output) == ('--no-view' not in options)


@pytest.mark.parametrize('command', [[], ['rig'], ['demo'], ['bench'], ['figures'], ['doctor']])
def test_the_help_pages_need_no_part(command, environ, tmp_path):
    process = ja(environ, tmp_path, *command, '--help')
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, output
    assert 'Usage' in output


@pytest.mark.parametrize(
    ('command', 'package'),
    [
        (['demo', '--no-view'], 'ja_sim'),
        (['rig', '--source', '.', '--no-view'], 'ja_sim'),
        (['demo', '--no-view', '--one-process'], 'ja_sim'),
        (['soak'], 'ja_sim'),
        (['bench'], 'ja_benchmarks'),
        (['figures'], 'ja_experiments'),
    ],
    ids=lambda value: value if isinstance(value, str) else ' '.join(value),
)
def test_a_command_that_needs_a_missing_part_says_so(command, package, environ, tmp_path):
    process = ja(environ, tmp_path, *command)
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 2
    assert output.startswith(f'error: {package} is not installed'), output
    assert output.count('\n') == 1
