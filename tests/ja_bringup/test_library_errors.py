"""A library that refuses another one at its import is a sentence, not a traceback."""

import os
import subprocess
import sys

import pytest

from ja_bringup import cli
from ja_common.core.config import ConfigError
from ros_testing import PATIENCE_S


def test_a_library_that_refuses_another_is_one_sentence(tmp_path):
    """As pyarrow 26 does with the NumPy of Ubuntu 24.04."""
    refusing = tmp_path / 'libraries' / 'pyarrow'
    refusing.mkdir(parents=True)
    why = 'pyarrow requires NumPy 2.0 or newer, found 1.26.4'
    (refusing / '__init__.py').write_text(f'raise ImportError({why!r})')
    path = os.pathsep.join(filter(None, [str(refusing.parent), os.environ.get('PYTHONPATH')]))
    ended = subprocess.run(
        [sys.executable, '-m', 'ja_bringup.cli', 'export', 'libraries', '--to', 'made'],
        cwd=tmp_path, env={**os.environ, 'PYTHONPATH': path}, capture_output=True, text=True,
        timeout=PATIENCE_S, check=False,
    )  # fmt: skip
    assert ended.returncode == 2
    assert ended.stderr.startswith(f'error: {why}; install versions that fit together: ')
    assert ended.stderr.count('\n') == 1


@pytest.mark.parametrize('name', ['ja_common.core.box', 'ja_sim.core'])
def test_an_import_error_of_our_own_keeps_its_traceback(monkeypatch, name):
    def fail(**_: object) -> None:
        raise ImportError('cannot import name', name=name)

    monkeypatch.setattr(cli, 'app', fail)
    monkeypatch.setattr(sys, 'argv', ['ja', 'export'])
    monkeypatch.setattr(cli, 'protect_children', lambda: None)
    with pytest.raises(ImportError) as raised:
        cli.main()
    assert not isinstance(raised.value, ConfigError)
