"""The ROS defaults of every entry point: set where the user has set nothing."""

import xml.etree.ElementTree as ElementTree
from importlib import metadata
from importlib.resources import files

import pytest

from ja_common.ros_defaults import (
    ENVIRONMENT,
    LEASE_S,
    LOCALHOST_PROFILE,
    NETWORK_PROFILE,
    PROFILE_VARIABLE,
    apply_ros_defaults,
    has_fast_dds_3,
    ros_distro,
)

RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'


@pytest.mark.parametrize('nothing', [{}, dict.fromkeys(ENVIRONMENT, '')])
def test_without_settings_of_the_user_every_default_is_set(nothing):
    environ = dict(nothing)
    apply_ros_defaults(environ)
    assert environ == ENVIRONMENT
    assert environ[RANGE] == 'LOCALHOST'


def test_users_own_settings_win():
    own = {RANGE: 'SUBNET', 'MALLOC_TOP_PAD_': 'no number', PROFILE_VARIABLE: 'mine.xml'}
    environ = dict(own)
    apply_ros_defaults(environ)
    assert environ == ENVIRONMENT | own


@pytest.mark.parametrize(
    ('settings', 'profile'),
    [
        ({}, LOCALHOST_PROFILE),
        ({RANGE: 'LOCALHOST'}, LOCALHOST_PROFILE),
        ({RANGE: 'OFF'}, LOCALHOST_PROFILE),
        ({RANGE: 'subnet'}, LOCALHOST_PROFILE),
        ({RANGE: 'SUBNET'}, NETWORK_PROFILE),
        ({RANGE: 'SYSTEM_DEFAULT'}, NETWORK_PROFILE),
        ({RANGE: 'SUBNET', 'ROS_LOCALHOST_ONLY': '0'}, NETWORK_PROFILE),
        ({RANGE: 'SUBNET', 'ROS_LOCALHOST_ONLY': '1'}, LOCALHOST_PROFILE),
        ({'ROS_LOCALHOST_ONLY': '0'}, LOCALHOST_PROFILE),
        ({'ROS_STATIC_PEERS': '10.0.0.2'}, LOCALHOST_PROFILE),
    ],
)
def test_profile_follows_the_range_as_ros_reads_it(settings, profile):
    environ = dict(settings)
    apply_ros_defaults(environ)
    assert environ[PROFILE_VARIABLE] == str(profile)


def test_profile_of_a_child_follows_a_range_that_its_parent_changed():
    environ: dict[str, str] = {}
    for name, profile in (('SUBNET', NETWORK_PROFILE), ('LOCALHOST', LOCALHOST_PROFILE)):
        environ[RANGE] = name
        apply_ros_defaults(environ)
        assert environ[PROFILE_VARIABLE] == str(profile)


@pytest.mark.parametrize(
    ('version', 'is_3'), [('7.1.6', False), ('8.0.0', False), ('9.1.2', True), ('10.0', True)]
)
def test_fast_dds_is_known_by_the_version_of_rclpy(version, is_3, monkeypatch):
    monkeypatch.setattr(metadata, 'version', lambda name: version)
    assert has_fast_dds_3() is is_3


@pytest.mark.parametrize(
    ('sourced', 'version', 'distro'),
    [('', '7.1.6', 'jazzy'), ('', '9.1.2', 'kilted'), ('kilted', '7.1.6', 'kilted')],
)
def test_the_distribution_is_the_sourced_one_or_that_of_the_wheels(
    sourced, version, distro, monkeypatch
):
    monkeypatch.setattr(metadata, 'version', lambda name: version)
    monkeypatch.setenv('ROS_DISTRO', sourced)
    assert ros_distro() == distro


def test_without_a_version_of_rclpy_fast_dds_is_that_of_jazzy(monkeypatch):
    def missing(name: str) -> str:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, 'version', missing)
    assert not has_fast_dds_3()


def test_the_profiles_differ_in_the_white_list_and_the_heartbeats_alone():
    local = ElementTree.fromstring(LOCALHOST_PROFILE.read_text())
    network = ElementTree.fromstring(NETWORK_PROFILE.read_text())
    (profiles,) = network.findall('{*}profiles')
    (writer,) = profiles.findall('{*}data_writer')
    assert [tag for tag, _ in entries(writer)][2].endswith(('heartbeatPeriod', 'heartbeat_period'))
    profiles.remove(writer)
    removed = []
    for parent in local.findall('.//{*}transport_descriptor'):
        for white_list in parent.findall('{*}interfaceWhiteList'):
            removed.append([address.text for address in white_list])
            parent.remove(white_list)
    assert removed == [['127.0.0.1']]
    assert entries(local) == entries(network)


def test_the_profile_for_fast_dds_3_differs_in_the_names_of_elements_alone():
    folder = files('ja_common')
    old, new = (
        ElementTree.fromstring((folder / name).read_text())
        for name in ('fastdds_network.xml', 'fastdds3_network.xml')
    )
    assert [text for _, text in entries(old)] == [text for _, text in entries(new)]
    renamed = {
        (before.rpartition('}')[2], after.rpartition('}')[2])
        for (before, _), (after, _) in zip(entries(old), entries(new), strict=True)
        if before != after
    }
    assert renamed == {('heartbeatPeriod', 'heartbeat_period')}


@pytest.mark.parametrize('profile', [LOCALHOST_PROFILE, NETWORK_PROFILE])
def test_lease_is_that_of_the_profile(profile):
    (lease,) = ElementTree.fromstring(profile.read_text()).findall('.//{*}leaseDuration')
    assert float(lease.findtext('{*}sec')) == LEASE_S


def entries(profile: ElementTree.Element) -> list[tuple[str, str]]:
    """Return the tag and the text of all elements, in order."""
    return [(element.tag, (element.text or '').strip()) for element in profile.iter()]
