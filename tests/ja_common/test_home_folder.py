"""A machine without a home folder that can be written: ROS and the libraries work all the same."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ja_common.core.home_folder import replace_missing_home
from ros_testing import PATIENCE_S

NAMES = {'ROS_LOG_DIR', 'NUMBA_CACHE_DIR', 'MPLCONFIGDIR'}


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path))
    return tmp_path


def test_a_home_that_can_be_written_is_used(tmp_path):
    environ = {'HOME': str(tmp_path)}
    replace_missing_home(environ)
    assert environ == {'HOME': str(tmp_path)}


@pytest.mark.parametrize('environ', [{}, {'HOME': '/dev/null/home'}, {'HOME': '/proc/missing'}])
def test_another_folder_takes_its_place(environ, temporary):
    replace_missing_home(environ)
    assert set(environ) - {'HOME'} == NAMES
    folder = Path(environ['ROS_LOG_DIR']).parent
    assert folder.parent == temporary
    assert folder.stat().st_mode & 0o777 == 0o700
    again = dict(environ, ROS_LOG_DIR='', NUMBA_CACHE_DIR='')
    replace_missing_home(again)
    assert again == environ  # the compiled code of the last process is found


def test_the_users_own_places_stay(temporary):
    for own in ({'ROS_LOG_DIR': '/mine'}, {'ROS_HOME': '/mine'}):
        environ = dict(own)
        replace_missing_home(environ)
        assert environ == own
    environ = {'NUMBA_CACHE_DIR': '/mine'}
    replace_missing_home(environ)
    assert environ['NUMBA_CACHE_DIR'] == '/mine'


def test_a_folder_that_others_may_write_is_not_used(temporary):
    prepared = temporary / f'joint-attention-{os.getuid()}'
    prepared.mkdir()
    prepared.chmod(0o777)
    environ: dict[str, str] = {}
    replace_missing_home(environ)
    assert prepared not in Path(environ['NUMBA_CACHE_DIR']).parents


def test_a_node_starts_without_a_home(domain, tmp_path):
    environ = {name: value for name, value in os.environ.items() if name not in NAMES}
    environ |= {'HOME': str(tmp_path / 'file' / 'home'), 'TMPDIR': str(tmp_path)}
    (tmp_path / 'file').write_text('')
    code = (
        'import os, signal\n'
        'from ja_common.graph_node import GraphNode\n'
        'from ja_common.node_main import spin_node\n'
        'def make():\n'
        "    print('made', flush=True)\n"
        '    os.kill(os.getpid(), signal.SIGTERM)\n'
        "    return GraphNode('alone')\n"
        'spin_node(make)\n'
    )
    node = subprocess.run(
        [sys.executable, '-c', code],
        env=environ,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )
    assert (node.returncode, node.stdout, node.stderr) == (0, 'made\n', '')
