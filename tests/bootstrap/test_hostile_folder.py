"""A command that is started in a foreign folder runs none of its files."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from bootstrap.machine import clean_environ, probe_python
from bootstrap.setup_environment import Environment
from hostile_folder import imported_from, make_hostile
from ros_testing import PATIENCE_S

ROOT = Path(__file__).parents[2]


def run(command: list[str], folder: Path, **environ: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=folder, env={**clean_environ(os.environ), **environ},
        capture_output=True, text=True, timeout=PATIENCE_S,
    )  # fmt: skip


def test_the_folder_of_these_tests_does_its_harm(tmp_path):
    """What follows would prove nothing if the files had no effect on a careless start."""
    hostile = make_hostile(tmp_path / 'hostile')
    run([sys.executable, '-c', 'import evil'], hostile)
    assert imported_from(hostile) == ['evil']


@pytest.mark.parametrize('pythonpath', ['', os.pathsep, f'{os.pathsep}/nowhere'])
def test_ja_imports_nothing_from_the_current_folder(pythonpath, tmp_path):
    hostile = make_hostile(tmp_path / 'hostile')
    if pythonpath:  # Python itself imports these at its start, before any line of ours
        for name in ('sitecustomize', 'usercustomize', 'pathlib', 'typing', 'runpy'):
            (hostile / f'{name}.py').unlink()
            (hostile / name / '__init__.py').unlink()
            (hostile / name).rmdir()
    shown = run([sys.executable, str(ROOT / 'ja'), '--help'], hostile, PYTHONPATH=pythonpath)
    assert 'joint attention' in shown.stdout, shown.stderr
    assert imported_from(hostile) == []


def test_an_interpreter_is_asked_without_the_current_folder(tmp_path, monkeypatch):
    hostile = make_hostile(tmp_path / 'hostile')
    monkeypatch.chdir(hostile)
    python = probe_python(sys.executable, {**os.environ, 'PYTHONPATH': ''})
    assert python is not None
    assert python.version == sys.version_info[:2]
    assert imported_from(hostile) == []


def test_the_set_up_runs_pip_without_the_current_folder(tmp_path, monkeypatch):
    hostile = make_hostile(tmp_path / 'hostile')
    monkeypatch.chdir(hostile)
    checkout = tmp_path / 'checkout'
    checkout.mkdir()
    environment = Environment(checkout, {**os.environ, 'PYTHONPATH': str(hostile)})
    (checkout / '.venv').symlink_to(ROOT / '.venv')
    environment._pip('--quiet', '--dry-run', '--no-deps', '--no-index', 'numpy')
    assert imported_from(hostile) == []
