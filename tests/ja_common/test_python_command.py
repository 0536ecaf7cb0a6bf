"""A Python that we start imports nothing from the folder it is started in."""

import os
import subprocess
import sys

import pytest

from hostile_folder import imported_from, make_hostile
from ja_common import python_command
from ja_common.python_command import code_command, module_command, protect_children


@pytest.mark.parametrize('has_p_option', [hasattr(sys.flags, 'safe_path'), False])
def test_a_module_is_found_but_not_in_the_current_folder(has_p_option, tmp_path, monkeypatch):
    hostile = make_hostile(tmp_path / 'hostile')
    monkeypatch.setattr(python_command, '_HAS_P_OPTION', has_p_option)
    command = module_command('json.tool', '--compact', '-')
    done = subprocess.run(
        command, cwd=hostile, input='[1, 2]', capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == '[1,2]'
    assert imported_from(hostile) == []


def test_neither_does_a_piece_of_code_search_it(tmp_path):
    hostile = make_hostile(tmp_path / 'hostile')
    command = code_command('import json; print(json.dumps(sys.argv[1:]))', 'a', 'b')
    done = subprocess.run(command, cwd=hostile, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == '["a", "b"]'
    assert imported_from(hostile) == []


def test_what_pythonpath_names_is_still_found(tmp_path):
    (tmp_path / 'mine.py').write_text('print("mine")')
    done = subprocess.run(
        module_command('mine'),
        env={**os.environ, 'PYTHONPATH': str(tmp_path)},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.strip() == 'mine'


@pytest.mark.skipif(sys.version_info < (3, 11), reason='3.10 has no PYTHONSAFEPATH')
def test_processes_that_libraries_start_are_protected_by_the_environment(tmp_path):
    hostile = make_hostile(tmp_path / 'hostile')
    environ = {**os.environ, 'PYTHONPATH': f'{os.pathsep}/nowhere'}
    protect_children(environ)
    assert environ['PYTHONPATH'] == '/nowhere'
    spawned = 'import multiprocessing as m; m.get_context("spawn").Pool(1).map(len, [""])'
    subprocess.run([sys.executable, '-c', spawned], cwd=hostile, env=environ, check=True)
    assert imported_from(hostile) == []
