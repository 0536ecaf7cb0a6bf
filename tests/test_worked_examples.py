"""The worked examples of docs/change_it: the code of the pages is run."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from ros_testing import PATIENCE_S

TESTS = Path(__file__).parent
PAGES = sorted((TESTS.parent / 'docs' / 'change_it').glob('a_new_*.md'))
# A block of Python whose first line names the file that it is.
_FILE = re.compile(r'^```python\n# (?P<path>\S+\.py)\n(?P<code>.*?)^```', re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.stem)
def test_the_code_of_a_page_passes_its_own_tests(page: Path, tmp_path: Path) -> None:
    text = page.read_text()
    files = {block['path']: block['code'] for block in _FILE.finditer(text)}
    assert len(files) == text.count('```python')
    for path, code in files.items():
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text(code)
    command = [sys.executable, '-m', 'pytest', '-q', '-p', 'conftest', 'my_lab']
    done = subprocess.run(
        command,
        cwd=tmp_path,
        env={**os.environ, 'PYTHONPATH': f'{tmp_path}{os.pathsep}{TESTS}'},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_there_is_a_page_for_each_thing_to_change() -> None:
    things = ('benchmark_entry', 'detector', 'head', 'learner')
    assert [page.stem for page in PAGES] == [f'a_new_{thing}' for thing in things]
