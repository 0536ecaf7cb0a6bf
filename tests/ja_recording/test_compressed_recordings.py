"""Compressed files and messages of rosbag2, written by another library or by hand."""

import bz2
import gzip
import shutil
from pathlib import Path
from random import Random

import lz4.frame
import pytest
import zstandard
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from foreign_bags import FLOAT, RATES, write_db3, write_mcap, write_metadata
from ja_common.core.config import ConfigError
from ja_recording.core import unpacking
from ja_recording.core.reader import Recording
from ja_recording.core.storage import DamagedError

PACK = {
    '.zstd': zstandard.compress,
    '.lz4': lz4.frame.compress,
    '.bz2': bz2.compress,
    '.gz': gzip.compress,
}
WRITE = {'.mcap': write_mcap, '.db3': write_db3}


@pytest.fixture(autouse=True)
def unpacked_in(tmp_path_factory, monkeypatch) -> Path:
    """Let temporary files be made in a folder of the test."""
    folder = tmp_path_factory.mktemp('unpacked')
    monkeypatch.setattr(unpacking.tempfile, 'tempdir', str(folder))
    return folder


def read(path: Path) -> list[bytes]:
    return [message.data for message in Recording(path).messages()]


def packed_file(folder: Path, storage: str = '.mcap', packing: str = '.zstd') -> Path:
    plain = WRITE[storage](folder / f'x_0{storage}')
    path = folder / f'x_0{storage}{packing}'
    path.write_bytes(PACK[packing](plain.read_bytes()))
    plain.unlink()
    return path


@pytest.mark.parametrize('packing', PACK)
@pytest.mark.parametrize('storage', WRITE)
def test_a_compressed_file_is_read_as_file_and_in_its_folder(
    storage, packing, tmp_path, unpacked_in
):
    path = packed_file(tmp_path, storage, packing)
    for given in (path, tmp_path):
        recording = Recording(given)
        assert [message.data for message in recording.messages()] == RATES
        assert recording.remarks == []
        del recording
    assert list(unpacked_in.iterdir()) == []
    assert list(tmp_path.iterdir()) == [path]


PLUGINS = {StoragePlugin.SQLITE3: '.db3', StoragePlugin.MCAP: '.mcap'}


@pytest.mark.parametrize('plugin', PLUGINS)
@pytest.mark.parametrize('mode', [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_what_another_library_compressed_is_read(mode, plugin, tmp_path):
    store = get_typestore(Stores.ROS2_JAZZY)
    writer = Writer(tmp_path / 'r', version=9, storage_plugin=plugin)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection('/rate', FLOAT, typestore=store)
        for number, data in enumerate(RATES):
            writer.write(connection, number + 1, data)
    assert read(tmp_path / 'r') == RATES
    (tmp_path / 'r' / 'metadata.yaml').unlink()
    assert read(tmp_path / 'r') == RATES


def test_a_file_that_lies_there_unpacked_as_well_is_read_once(tmp_path):
    path = packed_file(tmp_path)
    write_mcap(tmp_path / 'x_0.mcap')
    assert read(tmp_path) == RATES
    write_metadata(tmp_path, path.name, storage='mcap')
    recording = Recording(tmp_path)
    assert [message.data for message in recording.messages()] == RATES
    assert recording.remarks == []
    path.unlink()
    assert read(tmp_path) == RATES


@pytest.mark.parametrize('packing', PACK)
def test_a_half_downloaded_file_is_read_as_far_as_it_goes(packing, tmp_path):
    random = Random(0)
    data = [b'\0\1\0\0' + random.randbytes(1000) for _ in range(3000)]
    stamps = range(1, len(data) + 1)
    plain = write_mcap(tmp_path / 'x.mcap', stamps_ns=stamps, data=data, chunk_size=10**5)
    path = tmp_path / f'x.mcap{packing}'
    whole = PACK[packing](plain.read_bytes())
    path.write_bytes(whole[: len(whole) // 2])
    recording = Recording(path)
    found = [message.data for message in recording.messages()]
    assert 0 < len(found) < len(data)
    assert found == data[: len(found)]
    assert any('was not closed' in remark for remark in recording.remarks)


def test_a_file_larger_than_the_disk_is_not_unpacked(tmp_path, unpacked_in, monkeypatch):
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(unpacking.shutil, 'disk_usage', lambda _: usage._replace(free=1000))
    for packing in PACK:
        path = packed_file(tmp_path, '.db3', packing)
        with pytest.raises(ConfigError, match='TMPDIR') as refused:
            Recording(path)
        assert str(refused.value).startswith(str(path))
        path.unlink()
    assert list(unpacked_in.rglob('*.db3')) == []


@pytest.mark.parametrize(
    'content', [b'\x28\xb5\x2f\xfd', b'\x1f\x8b', b'BZh9', b'\x04\x22\x4d\x18']
)
def test_a_compressed_file_without_content_is_refused(content, tmp_path):
    path = tmp_path / 'x.mcap.zstd'
    for more in (b'', bytes(40)):
        path.write_bytes(content + more)
        with pytest.raises(ConfigError, match=r'x\.mcap\.zstd') as refused:
            Recording(path)
        assert '\n' not in str(refused.value)


def test_a_compressed_file_in_a_compressed_file_is_refused(tmp_path):
    path = packed_file(tmp_path)
    path.write_bytes(zstandard.compress(path.read_bytes()))
    with pytest.raises(ConfigError, match='neither MCAP nor SQLite'):
        Recording(path)


def test_a_message_that_would_fill_the_memory_is_left_out(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(unpacking, 'LARGEST_BYTES', 1000)
    bombs = [PACK[packing](bytes(10**6)) for packing in ('.zstd', '.lz4', '.bz2')]
    data = [bombs[0], RATES[1], bombs[1], bombs[2], b'\x28\xb5\x2f\xfdno', RATES[5]]
    path = write_mcap(tmp_path / 'x.mcap', data=data, chunk_size=10**6)
    assert read(path) == [RATES[1], RATES[5]]
    assert '4 damaged parts were left out; at /rate' in capsys.readouterr().err
    with pytest.raises(DamagedError, match='more than 1000 bytes'):
        unpacking.unpacked_message(bombs[0])
