"""Where neither shared memory nor UDP has room for images, a sentence says what to do."""

import shutil
import xml.etree.ElementTree as ElementTree
from types import SimpleNamespace

import pytest

from ja_common.ros_defaults import NETWORK_PROFILE
from ja_runner.image_transport import (
    SOCKET_BUFFER_BYTES,
    image_loss_warning,
    socket_buffer_advice,
)


@pytest.fixture
def limit_file(tmp_path):
    path = tmp_path / 'rmem_max'
    path.write_text('212992\n')
    return path


@pytest.mark.parametrize(
    ('free_mb', 'limit', 'warns'), [(1, 212992, True), (1, 4194304, False), (64, 212992, False)]
)
def test_one_way_with_room_is_enough(tmp_path, limit_file, monkeypatch, free_mb, limit, warns):
    monkeypatch.setattr(shutil, 'disk_usage', lambda _: SimpleNamespace(free=free_mb * 10**6))
    limit_file.write_text(f'{limit}\n')
    assert ('sysctl' in image_loss_warning(tmp_path, limit_file)) is warns


def test_a_folder_that_is_not_there_has_no_room(tmp_path, limit_file):
    warning = image_loss_warning(tmp_path / 'none', limit_file)
    assert 'none has 0 MB for them' in warning
    assert 'net.core.rmem_max=4194304' in warning


def test_a_system_without_the_limit_needs_no_advice(tmp_path):
    assert socket_buffer_advice(tmp_path / 'none') == ''


def test_buffers_are_those_of_the_profile():
    profile = ElementTree.fromstring(NETWORK_PROFILE.read_text())
    for name in ('sendBufferSize', 'receiveBufferSize'):
        (size,) = profile.findall(f'.//{{*}}{name}')
        assert int(size.text) == SOCKET_BUFFER_BYTES
