"""Each command ends with one sentence and its code, whatever happens to its output and files."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ros_testing import PATIENCE_S

JA = [sys.executable, '-m', 'ja_bringup.cli']


def ja(folder: Path, *args: str, **more) -> subprocess.CompletedProcess:
    return subprocess.run(
        [*JA, *args], cwd=folder, text=True, stderr=subprocess.PIPE, timeout=PATIENCE_S, **more
    )


@pytest.mark.parametrize('args', [['--help'], ['bench', 'none']], ids=['help', 'error'])
def test_a_full_disk_behind_the_output_is_one_sentence(args, tmp_path):
    with open('/dev/full', 'w') as full:
        ended = ja(tmp_path, *args, stdout=full)
    assert ended.returncode in (1, 2)
    assert ended.stderr.startswith('error: ')
    assert ended.stderr.count('\n') == 1


def test_a_reader_that_has_gone_is_no_error_to_report(tmp_path):
    reading, writing = os.pipe()
    os.close(reading)
    ended = ja(tmp_path, '--help', stdout=writing)
    os.close(writing)
    assert (ended.returncode, ended.stderr) == (1, '')


@pytest.mark.parametrize('full', [True, False], ids=['full disk', 'closed pipe'])
def test_what_python_still_holds_of_the_output_is_no_traceback(full):
    code = "from ja_bringup.clean_end import clean_end\nwith clean_end():\n    print('a result')"
    reading, writing = os.pipe()
    os.close(reading)
    with open('/dev/full', 'w') as disk:
        output = disk if full else writing
        ended = subprocess.run(
            [sys.executable, '-c', code], stdout=output, stderr=subprocess.PIPE, text=True
        )
    os.close(writing)
    sentence = 'error: the output cannot be written (No space left on device)\n'
    assert (ended.returncode, ended.stderr) == (1, sentence if full else '')


@pytest.mark.parametrize(
    'args',
    [
        ['demo', '--no-view'],
        ['demo', '--no-view', '--one-process'],
        ['rig', '--no-view'],
        ['soak'],
        ['figures'],
        ['figures', '--output', 'runs/report'],
        ['sweep', 'grid.yaml'],
        ['record'],
        ['record', '--output', 'runs/record'],
        ['bench', 'memory', '--json', 'runs'],
        ['reference', '--folder', 'runs/docs'],
        ['calibrate', '--to', 'folder'],
    ],
    ids=' '.join,
)
def test_a_place_that_cannot_be_written_is_found_before_the_work(args, tmp_path, domain):
    (tmp_path / 'runs').write_text('a file, where a folder is needed')
    (tmp_path / 'folder').mkdir()
    if args[0] == 'bench':
        (tmp_path / 'runs').unlink()
        (tmp_path / 'runs').mkdir()
    (tmp_path / 'grid.yaml').write_text('seeds: [0]\n')
    ended = ja(tmp_path, *args, stdout=subprocess.PIPE)
    assert ended.returncode == 2, ended.stderr
    text = (ended.stdout + ended.stderr).strip()
    assert text.startswith('error: ')
    assert 'cannot be written' in text
    assert '\n' not in text
    assert sorted(path.name for path in tmp_path.iterdir()) == ['folder', 'grid.yaml', 'runs']
