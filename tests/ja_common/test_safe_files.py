"""Whatever a file holds, reading it ends soon, in a table or in one sentence."""

import json
import os
import re
import socket
from pathlib import Path

import pytest

from ja_common.core.config import ConfigError
from ja_common.core.safe_files import load_json, load_yaml, parse_yaml, read_bytes, read_text

LAUGHS = 'a: &a [x, x]\n' + ''.join(
    f'{chr(98 + n)}: &{chr(98 + n)} [{", ".join([f"*{chr(97 + n)}"] * 9)}]\n' for n in range(20)
)
BAD_YAML = {
    'alias bomb': LAUGHS,
    'one alias': 'a: &a 1\nb: *a',
    'endless alias': 'a: &a [*a]',
    'not UTF-8': b'a: \xff\xfe',
    'UTF-16': 'a: 1'.encode('utf-16'),
    'NUL': 'a: \0',
    'deep list': 'a: ' + '[' * 5000,
    'deep table': ''.join(' ' * n + 'a:\n' for n in range(500)),
    'the same key twice': 'a: 1\nb: 2\na: 3',
    'a list': '[1, 2]',
    'a number': '5',
    'a key that is a number': '5: 6',
    'a key that is a list': '? [a]\n: 1',
    'a tag of Python': 'a: !!python/object/apply:os.system [echo]',
    'a tag that fails': 'a: !!bool maybe',
    'a tag without a value': 'a: !!int ""',
    'no date': 'a: 2026-99-99',
    'a number too long': 'a: ' + '9' * 5000,
    'binary without digits': 'a: 0b_',
    'two documents': 'a: 1\n---\na: 2',
    'too long': '#' * (2**20 + 1),
    'not closed': 'a: [1, 2',
    'tab': 'a:\n\t- 1',
}


@pytest.mark.parametrize('text', BAD_YAML.values(), ids=BAD_YAML)
def test_yaml_that_cannot_be_used_is_refused_in_one_sentence(text, tmp_path):
    path = tmp_path / 'x.yaml'
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ConfigError) as refused:
        load_yaml(path)
    sentence = str(refused.value)
    assert sentence.startswith(str(path))
    assert '\n' not in sentence
    assert len(sentence) < 500


def test_the_line_of_the_mistake_is_named(tmp_path):
    (tmp_path / 'x.yaml').write_text('a: 1\nb: 2\na: 3\n')
    with pytest.raises(ConfigError, match=r"x\.yaml:3: not YAML: 'a' is given twice"):
        load_yaml(tmp_path / 'x.yaml')


def test_a_table_is_read(tmp_path):
    (tmp_path / 'x.yaml').write_text('\ufeffa: [1, 2.5, yes]\nb: {c: d}\n', encoding='utf-8')
    assert load_yaml(tmp_path / 'x.yaml') == {'a': [1, 2.5, True], 'b': {'c': 'd'}}
    (tmp_path / 'empty.yaml').write_text('# nothing\n')
    assert load_yaml(tmp_path / 'empty.yaml') == {}
    assert parse_yaml('- a: 1', 'here') == [{'a': 1}]


def make_special(kind: str, folder: Path) -> Path:
    path = folder / 'special'
    if kind == 'folder':
        path.mkdir()
    elif kind == 'pipe':
        os.mkfifo(path)
    elif kind == 'socket':
        socket.socket(socket.AF_UNIX).bind(str(path))
    elif kind == 'link to a device':
        path.symlink_to('/dev/zero')
    elif kind == 'link to itself':
        path.symlink_to(path)
    return {'device': Path('/dev/zero'), 'NUL': Path('a\0b'), 'long': Path('x' * 5000)}.get(
        kind, path
    )


@pytest.mark.parametrize(
    'kind',
    ['missing', 'folder', 'pipe', 'socket', 'device', 'link to a device', 'link to itself',
     'NUL', 'long'],
)  # fmt: skip
def test_what_is_no_regular_file_is_refused_without_waiting(kind, tmp_path):
    path = make_special(kind, tmp_path)
    for read in (load_yaml, load_json, read_text, lambda path: read_bytes(path, 10)):
        with pytest.raises(ConfigError, match=r'no such file|cannot be read|is needed'):
            read(path)


def test_a_file_without_end_is_read_up_to_its_limit(tmp_path):
    with (tmp_path / 'sparse').open('wb') as file:
        file.truncate(2**40)
    with pytest.raises(ConfigError, match='larger than the 100 bytes'):
        read_bytes(tmp_path / 'sparse', 100)


@pytest.mark.parametrize('text', ['[' * 10**5, '{"a": ', '[1]', 'nothing', '', '9' * 5000])
def test_json_that_cannot_be_used_is_refused_in_one_sentence(text, tmp_path):
    (tmp_path / 'x.json').write_text(text)
    with pytest.raises(ConfigError, match=r'x\.json'):
        load_json(tmp_path / 'x.json')
    (tmp_path / 'x.json').write_text(json.dumps({'a': 1}))
    assert load_json(tmp_path / 'x.json') == {'a': 1}


def test_yaml_and_json_files_are_read_by_this_module_alone():
    sources = Path(__file__).parents[2] / 'ros2_ws' / 'src'
    careless = re.compile(r'yaml\.(safe_load|load|compose)\(|json\.load\(|json\.loads\(.*read_')
    found = {
        path.name
        for path in sources.rglob('*.py')
        if careless.search(path.read_text()) and path.name != 'safe_files.py'
    }
    assert found <= {'hosts.py'}, 'hosts.py reads what its own process has written'
