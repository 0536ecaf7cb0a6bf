"""The ROS defaults of every entry point: set where the user has set nothing."""

import xml.etree.ElementTree as ElementTree

from ja_common.ros_defaults import ENVIRONMENT, LEASE_S, PROFILE, apply_ros_defaults


def test_without_settings_of_the_user_every_default_is_set():
    environ = {}
    apply_ros_defaults(environ)
    assert environ == ENVIRONMENT
    assert environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'


def test_users_own_settings_win():
    own = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET', 'MALLOC_TOP_PAD_': 'no number'}
    environ = dict(own)
    apply_ros_defaults(environ)
    assert environ == ENVIRONMENT | own


def test_profile_is_shipped_and_readable():
    profile = ElementTree.fromstring(PROFILE.read_text())
    assert [e for e in profile.iter() if e.tag.endswith('segment_size')]


def test_lease_is_that_of_the_profile():
    profile = ElementTree.fromstring(PROFILE.read_text())
    (lease,) = [e for e in profile.iter() if e.tag.endswith('leaseDuration')]
    assert float(lease.findtext('{*}sec')) == LEASE_S
