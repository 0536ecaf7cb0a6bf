"""Weight files are read in one place, which notes what was really opened."""

import hashlib

import pytest
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from ja_common.core.weight_files import (
    changed_weight_files,
    note_weight_files,
    note_weights_at,
    read_weights,
    weight_files_text,
)
from ja_common.weight_files_codec import decode_weight_files, encode_weight_files

SHA = {name: hashlib.sha256(name.encode()).hexdigest() for name in ('a.onnx', 'b.xml')}


@pytest.fixture
def files(tmp_path):
    for name in SHA:
        (tmp_path / name).write_text(name)
    return [tmp_path / name for name in SHA]


def test_what_was_read_is_noted_with_the_hash_of_its_bytes(files):
    with note_weight_files() as notes:
        assert read_weights(files[0]) == b'a.onnx'
        assert note_weights_at(files[1]) == files[1]
    assert notes == SHA


def test_each_notes_only_what_was_read_meanwhile(files):
    read_weights(files[0])
    with note_weight_files() as outer:
        with note_weight_files() as inner:
            pass
        read_weights(files[1])
    read_weights(files[0])
    assert (list(outer), list(inner)) == (['b.xml'], [])


def test_there_and_back():
    assert decode_weight_files(encode_weight_files('/eyes', SHA)) == SHA


@pytest.mark.parametrize(
    'values', [{'a': 'no hash'}, {'a': ''}, dict.fromkeys(map(str, range(33)), 'a' * 64)]
)
def test_what_is_no_hash_is_refused(values):
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    with pytest.raises(ValueError, match='weight_files'):
        decode_weight_files(DiagnosticStatus(values=pairs))


def test_changes_are_named():
    other = {**SHA, 'a.onnx': 'f' * 64}
    assert changed_weight_files(SHA, SHA) == ''
    was = SHA['a.onnx'][:16]
    assert changed_weight_files(SHA, other) == f'a.onnx was {was} and is {"f" * 16}'
    assert changed_weight_files({}, {'a': 'c' * 64}) == f'a was none and is {"c" * 16}'
    assert weight_files_text(SHA).split() == [f'{name}={sha[:16]}' for name, sha in SHA.items()]
