"""The doctor finds what is wrong, and how to fix it."""

import os
import socket
import sys

import pytest

from ja_diagnostics import doctor
from ja_diagnostics.doctor import (
    check_ports,
    check_python,
    check_shared_memory,
    check_stale_segments,
    checks,
)


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


def test_shared_memory_that_is_not_there(tmp_path):
    assert not check_shared_memory(tmp_path / 'none').ok
    assert check_shared_memory(tmp_path).name == 'shared memory'


def test_segments_in_use_are_not_stale(tmp_path, monkeypatch):
    for name in ('fastrtps_dead', 'fastrtps_alive', 'fastrtps_dead_el', 'other'):
        (tmp_path / name).write_bytes(bytes(5000))
    monkeypatch.setattr(doctor, '_files_in_use', lambda: {str(tmp_path / 'fastrtps_alive')})
    assert check_stale_segments(tmp_path).text.startswith('1 left behind')


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
