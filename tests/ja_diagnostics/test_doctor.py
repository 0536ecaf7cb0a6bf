"""The doctor finds what is wrong, and how to fix it."""

import mmap
import os
import shutil
import socket
import subprocess
import sys
from types import SimpleNamespace

import pytest

from ja_common.middleware import load_middleware
from ja_diagnostics import doctor, image_stream
from ja_diagnostics.doctor import (
    check_ports,
    check_python,
    check_rclpy,
    check_shared_memory,
    check_stale_segments,
    checks,
)
from ros_testing import PATIENCE_S


def test_every_check_has_the_name_of_its_finding(domain):
    quick = {name: check for name, check in checks().items() if name != 'discovery'}
    for name, check in quick.items():
        finding = check()
        assert finding.name == name
        assert finding.ok or finding.fix


@pytest.mark.parametrize(('version', 'ok'), [((3, 9), False), ((3, 10), True), ((3, 14), False)])
def test_the_version_of_python(version, ok, monkeypatch):
    monkeypatch.setattr(sys, 'version_info', (*version, 0))
    finding = check_python()
    assert finding.ok is ok
    assert ('JA_PYTHON' in finding.fix) is not ok


@pytest.fixture
def missing_middleware(monkeypatch):
    """Let rcl look for a middleware that is not installed, in the processes that are started."""
    monkeypatch.setenv('RMW_IMPLEMENTATION', 'rmw_of_another_lab_cpp')
    load_middleware.cache_clear()
    yield
    load_middleware.cache_clear()


@pytest.mark.usefixtures('domain', 'missing_middleware')
def test_a_middleware_that_is_not_installed_is_a_finding_and_not_the_end():
    finding = check_rclpy()
    assert not finding.ok
    assert 'rmw_of_another_lab_cpp' in finding.text
    assert '/' not in finding.text, 'no places in the source of rcl'
    assert finding.fix.startswith('unset RMW_IMPLEMENTATION')
    assert 'rclpy' in doctor.check_discovery().text


@pytest.mark.usefixtures('missing_middleware')
def test_a_command_ends_with_one_sentence_where_the_middleware_is_not_installed():
    command = [sys.executable, '-m', 'ja_bringup', 'topics']
    ended = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
    assert ended.returncode == 2
    (line,) = ended.stderr.splitlines()
    assert line.startswith('error: RMW_IMPLEMENTATION=rmw_of_another_lab_cpp cannot be loaded')
    assert 'unset RMW_IMPLEMENTATION' in line


@pytest.mark.parametrize('domain_id', ['abc', '300', '-1'])
def test_a_domain_that_does_not_exist_is_a_finding(monkeypatch, domain_id):
    monkeypatch.setenv('ROS_DOMAIN_ID', domain_id)
    assert repr(domain_id) in check_ports().text
    assert not check_ports().ok
    assert 'see ports' in doctor.check_discovery().fix


def test_shared_memory_that_is_not_there(tmp_path):
    assert not check_shared_memory(tmp_path / 'none').ok


@pytest.mark.parametrize(('free_mb', 'ok'), [(63, False), (64, True)])
def test_shared_memory_must_have_room_for_images(free_mb, ok, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, 'disk_usage', lambda _: SimpleNamespace(free=free_mb * 10**6))
    finding = check_shared_memory(tmp_path)
    assert finding.text.startswith(f'{free_mb} MB free')
    assert (finding.ok, bool(finding.fix)) == (ok, not ok)


def test_segments_in_use_are_not_stale(tmp_path, monkeypatch):
    for name in ('fastrtps_dead', 'fastrtps_alive', 'fastrtps_dead_el', 'other'):
        (tmp_path / name).write_bytes(bytes(5000))
    monkeypatch.setattr(doctor, '_files_in_use', lambda: {str(tmp_path / 'fastrtps_alive')})
    assert check_stale_segments(tmp_path).text.startswith('1 left behind')


def test_a_mapped_segment_is_in_use(tmp_path):
    path = tmp_path / 'fastrtps_mapped'
    path.write_bytes(bytes(5000))
    assert str(path) not in doctor._files_in_use()
    with path.open('r+b') as file, mmap.mmap(file.fileno(), 0):
        assert str(path) in doctor._files_in_use()


@pytest.mark.usefixtures('domain')
def test_two_processes_discover_each_other_and_images_arrive():
    finding = doctor.check_discovery()
    assert finding.ok, finding
    assert finding.text.startswith('found in ')


@pytest.mark.usefixtures('domain')
def test_processes_that_do_not_discover_each_other_are_reported(monkeypatch):
    monkeypatch.setattr(image_stream, 'PUBLISH', 'no such word')
    monkeypatch.setattr(image_stream, 'RECEIVE', 'no such word')
    finding = doctor.check_discovery()
    assert not finding.ok
    assert 'did not find each other' in finding.text
    assert finding.fix


def test_the_ports_of_the_domain(domain, monkeypatch):
    assert 'free' in check_ports().text
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(('127.0.0.1', 7400 + 250 * domain + 10))
        assert 'another ROS 2 graph' in check_ports().text
    monkeypatch.setitem(os.environ, 'ROS_DOMAIN_ID', '150')
    assert not check_ports().ok


@pytest.mark.usefixtures('domain')
def test_a_graphics_driver_that_fails_is_reported(monkeypatch):
    monkeypatch.setattr(doctor, '_RENDER', 'raise OSError("no libEGL")')
    finding = doctor.check_graphics()
    assert not finding.ok
    assert 'no libEGL' in finding.text
    assert 'libegl1' in finding.fix
