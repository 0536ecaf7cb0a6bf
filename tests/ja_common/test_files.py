"""Files are written whole or not at all, and what prevents it is one sentence."""

import os
import stat

import pytest

from files_testing import disk_with_room_for
from ja_common.core.config import ConfigError
from ja_common.core.files import (
    SaveError,
    atomic_file,
    check_file_writable,
    check_writable,
    write_file,
)


def test_a_file_is_written_with_its_folders(tmp_path):
    path = tmp_path / 'not' / 'yet' / 'there.txt'
    write_file(path, 'über')
    assert path.read_bytes() == 'über'.encode()
    write_file(path, b'\x00')
    assert path.read_bytes() == b'\x00'
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize('room', [0, 4096], ids=['full', 'full in the middle'])
def test_a_full_disk_destroys_nothing_and_leaves_nothing(room, tmp_path):
    path = tmp_path / 'kept'
    write_file(path, 'the old one')
    with disk_with_room_for(room), pytest.raises(SaveError) as refused:
        write_file(path, bytes(100_000))
    text = f'{path} cannot be written (File too large): make room on its disk'
    assert str(refused.value) == text
    assert path.read_text() == 'the old one'
    assert list(tmp_path.iterdir()) == [path]
    write_file(path, 'the new one')
    assert path.read_text() == 'the new one'


def test_an_error_in_the_block_leaves_the_old_file(tmp_path):
    path = tmp_path / 'kept'
    write_file(path, 'the old one')
    with pytest.raises(KeyboardInterrupt), atomic_file(path) as file:  # noqa: PT012
        file.write(b'half')
        raise KeyboardInterrupt
    assert path.read_text() == 'the old one'
    assert list(tmp_path.iterdir()) == [path]


def test_a_path_below_a_file_and_the_name_of_a_folder_are_refused(tmp_path):
    (tmp_path / 'file').write_text('')
    (tmp_path / 'folder').mkdir()
    for path, why in (
        (tmp_path / 'file' / 'x', f'{tmp_path}/file is no folder'),
        (tmp_path / 'file' / 'y' / 'x', f'{tmp_path}/file is no folder'),
        (tmp_path / 'folder', 'its name is taken'),
    ):
        with pytest.raises(SaveError) as refused:
            write_file(path, 'x')
        text = f'{path} cannot be written ({why}): remove that, or name another place'
        assert str(refused.value) == text
    assert (tmp_path / 'file').read_text() == ''
    assert not list((tmp_path / 'folder').iterdir())


def test_a_link_stays_a_link(tmp_path):
    target, link = tmp_path / 'target', tmp_path / 'link'
    target.write_text('old')
    link.symlink_to(target)
    write_file(link, 'new')
    assert link.is_symlink()
    assert target.read_text() == 'new'


def test_a_device_stays_a_device(tmp_path):
    """As root, a rename would replace /dev/null by a file."""
    pipe = tmp_path / 'pipe'
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_file(pipe, 'through')
    assert os.read(reader, 100) == b'through'
    os.close(reader)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    with pytest.raises(SaveError, match=r'/dev/full cannot be written \(No space left on device'):
        write_file(type(tmp_path)('/dev/full'), 'nowhere')


def test_a_folder_is_checked_before_a_run(tmp_path):
    check_writable(tmp_path / 'new' / 'folder')
    check_file_writable(tmp_path / 'other' / 'file.csv')
    assert not list((tmp_path / 'new' / 'folder').iterdir())
    assert not list((tmp_path / 'other').iterdir())
    (tmp_path / 'file').write_text('')
    with pytest.raises(ConfigError, match='file cannot be written'):
        check_writable(tmp_path / 'file')
    with pytest.raises(ConfigError, match='cannot be written'):
        check_writable(tmp_path / 'file' / 'below')
    with pytest.raises(ConfigError, match=r'new cannot be written \(its name is taken'):
        check_file_writable(tmp_path / 'new')
    with disk_with_room_for(100), pytest.raises(ConfigError, match='make room on its disk'):
        check_writable(tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ['file', 'new', 'other']
