"""The ROS defaults of every entry point: set where the user has set nothing."""

import xml.etree.ElementTree as ElementTree

import pytest

from ja_common.ros_defaults import (
    ENVIRONMENT,
    LEASE_S,
    LOCALHOST_PROFILE,
    NETWORK_PROFILE,
    apply_ros_defaults,
)

RANGE, PROFILE = 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'FASTRTPS_DEFAULT_PROFILES_FILE'


@pytest.mark.parametrize('nothing', [{}, dict.fromkeys(ENVIRONMENT, '')])
def test_without_settings_of_the_user_every_default_is_set(nothing):
    environ = dict(nothing)
    apply_ros_defaults(environ)
    assert environ == ENVIRONMENT
    assert environ[RANGE] == 'LOCALHOST'


def test_users_own_settings_win():
    own = {RANGE: 'SUBNET', 'MALLOC_TOP_PAD_': 'no number', PROFILE: 'mine.xml'}
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
    assert environ[PROFILE] == str(profile)


def test_profile_of_a_child_follows_a_range_that_its_parent_changed():
    environ: dict[str, str] = {}
    for name, profile in (('SUBNET', NETWORK_PROFILE), ('LOCALHOST', LOCALHOST_PROFILE)):
        environ[RANGE] = name
        apply_ros_defaults(environ)
        assert environ[PROFILE] == str(profile)


def test_the_profiles_differ_in_the_white_list_alone():
    local = ElementTree.fromstring(LOCALHOST_PROFILE.read_text())
    network = ElementTree.fromstring(NETWORK_PROFILE.read_text())
    removed = []
    for parent in local.findall('.//{*}transport_descriptor'):
        for white_list in parent.findall('{*}interfaceWhiteList'):
            removed.append([address.text for address in white_list])
            parent.remove(white_list)
    assert removed == [['127.0.0.1']]
    assert entries(local) == entries(network)


@pytest.mark.parametrize('profile', [LOCALHOST_PROFILE, NETWORK_PROFILE])
def test_lease_is_that_of_the_profile(profile):
    (lease,) = ElementTree.fromstring(profile.read_text()).findall('.//{*}leaseDuration')
    assert float(lease.findtext('{*}sec')) == LEASE_S


def entries(profile: ElementTree.Element) -> list[tuple[str, str]]:
    """Return the tag and the text of all elements, in order."""
    return [(element.tag, (element.text or '').strip()) for element in profile.iter()]
