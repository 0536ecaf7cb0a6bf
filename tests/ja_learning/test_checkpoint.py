"""Checkpoints: all or nothing on disk, and no file can do harm by being loaded."""

import io
import os
import pickle
import zipfile

import numpy as np
import pytest

from ja_learning.core import checkpoint
from ja_learning.core.checkpoint import load_checkpoint, save_checkpoint

ARRAYS = {'weights': np.arange(6.0).reshape(2, 3), 'trials': np.array(7)}


@pytest.fixture
def path(tmp_path):
    return tmp_path / 'learner.npz'


def assert_holds(path, arrays, kind='paper'):
    loaded, description = load_checkpoint(path)
    assert description['learner'] == kind
    assert loaded.keys() == arrays.keys()
    assert all(np.array_equal(loaded[name], arrays[name]) for name in arrays)


def test_there_and_back(path):
    save_checkpoint(path, ARRAYS, {'learner': 'paper'})
    assert_holds(path, ARRAYS)
    assert os.listdir(path.parent) == [path.name]


def test_folder_is_made_and_an_old_file_replaced(tmp_path):
    path = tmp_path / 'new' / 'folder' / 'a.npz'
    save_checkpoint(path, {'weights': np.zeros(2)}, {'learner': 'old'})
    save_checkpoint(path, ARRAYS, {'learner': 'paper'})
    assert_holds(path, ARRAYS)


@pytest.mark.parametrize('step', ['savez', 'fsync', 'replace'])
def test_old_file_stays_whole_when_writing_fails(path, monkeypatch, step):
    save_checkpoint(path, ARRAYS, {'learner': 'paper'})

    def full(*_args, **_kwargs):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(np if step == 'savez' else os, step, full)
    with pytest.raises(OSError, match='No space left'):
        save_checkpoint(path, {'weights': np.zeros(2)}, {'learner': 'new'})
    monkeypatch.undo()
    assert_holds(path, ARRAYS)
    assert os.listdir(path.parent) == [path.name], 'nothing half-written is left'


def test_missing_file_is_named(path):
    with pytest.raises(FileNotFoundError, match=rf'no checkpoint at {path}'):
        load_checkpoint(path)


def test_every_damage_is_one_clear_error_or_does_no_harm(path):
    """A byte changed or the end cut off, at hundreds of places."""
    save_checkpoint(path, ARRAYS, {'learner': 'paper'})
    good = path.read_bytes()
    rng = np.random.default_rng(0)
    damaged = [good[:length] for length in range(0, len(good), 37)]
    for place in range(0, len(good), 3):
        flipped = bytearray(good)
        flipped[place] ^= int(rng.integers(1, 256))
        damaged.append(bytes(flipped))
    refused = []
    for content in damaged:
        path.write_bytes(content)
        try:
            assert_holds(path, ARRAYS)
        except ValueError as error:
            refused.append(str(error))
    assert len(refused) > len(damaged) / 2
    assert all(str(path) in text for text in refused)


class Bomb:
    """Pickled, it runs code when it is loaded."""

    def __reduce__(self):
        return (pytest.fail, ('code from a checkpoint was run',))


def foreign_files(path):
    yield 'plain pickle', lambda: path.write_bytes(pickle.dumps(Bomb()))
    yield 'pickle in an array', lambda: np.savez(path, description=np.array(Bomb(), object))
    yield 'npy', lambda: np.save(path.open('wb'), np.zeros(3))
    yield 'text', lambda: path.write_text('weights: 1 2 3')
    yield 'empty', lambda: path.write_bytes(b'')
    yield 'folder', path.mkdir
    yield 'other npz', lambda: np.savez(path, weights=np.zeros(3))
    yield 'no dictionary', lambda: np.savez(path, description=np.array('[1, 2]'))
    yield 'no JSON', lambda: np.savez(path, description=np.array('hello'))
    yield 'deep JSON', lambda: np.savez(path, description=np.array('[' * 10**5))
    yield 'long description', lambda: np.savez(path, description=np.array('{}' + ' ' * 10**5))
    good = {'description': npy(np.array('{}'))}
    yield 'raw member', lambda: write_members(path, good | {'weights': b'raw'})
    yield 'path upwards', lambda: write_members(path, good | {'../weights.npy': npy(1.0)})
    yield 'absolute path', lambda: write_members(path, good | {'/weights.npy': npy(1.0)})
    yield 'name of a class', lambda: write_members(path, good | {'__class__.npy': npy(1.0)})
    yield 'many members', lambda: write_members(path, {f'a{n}.npy': npy(1) for n in range(1001)})
    yield 'no header', lambda: write_members(path, good | {'weights.npy': b'raw'})
    yield 'other version', lambda: write_members(path, good | {'a.npy': b'\x93NUMPY\x09\x00'})
    yield 'lying shape', lambda: write_members(path, good | {'a.npy': lying((10**15,))})
    yield 'negative shape', lambda: write_members(path, good | {'a.npy': lying((-1,))})
    yield 'no shape', lambda: write_members(path, good | {'a.npy': lying('x')})
    yield 'structure', lambda: write_members(path, good | {'a.npy': npy(np.zeros(2, 'f4,i4'))})
    yield 'dates', lambda: write_members(path, good | {'a.npy': npy(np.zeros(2, 'M8[s]'))})
    yield 'lying size', lambda: lie_about_size(path)


def npy(array) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def lying(shape) -> bytes:
    """Return a .npy of one number that claims another shape."""
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape!r}}}".ljust(117) + '\n'
    return b'\x93NUMPY\x01\x00' + len(header).to_bytes(2, 'little') + header.encode() + bytes(8)


def write_members(path, members: dict[str, bytes]) -> None:
    with zipfile.ZipFile(path, 'w') as archive:
        for name, content in members.items():
            archive.writestr(name, content)


def lie_about_size(path) -> None:
    """Write a member whose sizes in the directory are 4 GB."""
    write_members(path, {'a.npy': npy(1.0)})
    content = bytearray(path.read_bytes())
    directory = content.index(b'PK\x01\x02')
    content[directory + 24 : directory + 28] = b'\xfe\xff\xff\xff'
    path.write_bytes(content)


@pytest.mark.parametrize('number', range(24))
def test_foreign_file_is_refused_in_one_sentence(path, number):
    _what, write = list(foreign_files(path))[number]
    write()
    with pytest.raises(ValueError, match=rf'{path} is not a (readable )?checkpoint') as caught:
        load_checkpoint(path)
    assert '\n' not in str(caught.value)


def test_other_format_is_named(path):
    np.savez(path, description=np.array('{"format": "someone-else-3"}'))
    with pytest.raises(ValueError, match="has format 'someone-else-3', not 'joint-attention"):
        load_checkpoint(path)


def test_the_versions_that_wrote_it_are_in_it(path):
    save_checkpoint(path, ARRAYS, {'learner': 'paper'})
    _, description = load_checkpoint(path)
    assert description['versions']['numpy'] == np.__version__
    assert description['versions'].keys() == {'ja_learning', 'torch', 'numpy'}


def test_no_file_fills_the_memory(path, monkeypatch):
    np.savez_compressed(path, description=np.array('{}'), zeros=np.zeros(100_000))
    assert path.stat().st_size < 10_000
    monkeypatch.setattr(checkpoint, 'LARGEST_BYTES', 100_000)
    with pytest.raises(ValueError, match='bytes are more than 100000'):
        load_checkpoint(path)
    with pytest.raises(ValueError, match='let the learner remember fewer trials'):
        save_checkpoint(path, {'faces': np.zeros(100_000)}, {'learner': 'paper'})


@pytest.mark.parametrize('kind', ['pipe', 'device'])
def test_what_is_no_file_is_refused_without_waiting(path, kind):
    if kind == 'pipe':
        os.mkfifo(path)
    else:
        path.symlink_to('/dev/zero')
    with pytest.raises(ValueError, match='is not a checkpoint'):
        load_checkpoint(path)


def test_the_same_array_twice_is_refused(path):
    with zipfile.ZipFile(path, 'w') as archive:
        archive.writestr('a.npy', npy(1.0))
        with pytest.warns(UserWarning, match='Duplicate name'):
            archive.writestr('a.npy', npy(2.0))
    with pytest.raises(ValueError, match='there twice'):
        load_checkpoint(path)
