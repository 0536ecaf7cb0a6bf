"""ruff and mypy, as part of the suite: each of their findings is a failure."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.mark.parametrize(
    'tool',
    [['ruff', 'check', '.', 'ja'], ['ruff', 'format', '--check', '.', 'ja'], ['mypy']],
    ids=lambda command: ' '.join(command[:2]),
)
def test_is_clean(tool):
    result = subprocess.run(
        [sys.executable, '-m', *tool], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
