"""The ROS defaults of every entry point. Why each is there: docs/ros_defaults.md."""

import ctypes
import os
from collections.abc import Mapping, MutableMapping
from importlib import metadata
from importlib.resources import files

# rclpy 7 of ROS 2 Jazzy runs on Fast DDS 2, and rclpy 9 of Kilted on Fast DDS 3.
_FIRST_WITH_FAST_DDS_3 = 9


def has_fast_dds_3() -> bool:
    """Return whether the rclpy that Python finds belongs to a ROS with Fast DDS 3."""
    try:
        return int(metadata.version('rclpy').partition('.')[0]) >= _FIRST_WITH_FAST_DDS_3
    except (metadata.PackageNotFoundError, ValueError):
        return False


def ros_distro() -> str:
    """Return the name of the ROS distribution that is sourced, or whose wheels are installed."""
    return os.environ.get('ROS_DISTRO') or ('kilted' if has_fast_dds_3() else 'jazzy')


PROFILE_VARIABLE = f'FAST{"DDS" if has_fast_dds_3() else "RTPS"}_DEFAULT_PROFILES_FILE'
"""The environment variable from which the installed Fast DDS reads the file of its profile."""

LOCALHOST_PROFILE = files('ja_common') / 'fastdds_localhost.xml'
# Some elements have other names in Fast DDS 3; it refuses a file with one of the old names.
NETWORK_PROFILE = files('ja_common') / (
    'fastdds3_network.xml' if has_fast_dds_3() else 'fastdds_network.xml'
)
LEASE_S = 2.0
"""In both profiles: after this silence [s] other nodes take a node for dead."""

ENVIRONMENT = {
    'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
    PROFILE_VARIABLE: str(LOCALHOST_PROFILE),
    'MALLOC_MMAP_THRESHOLD_': str(32 * 2**20),
    'MALLOC_TRIM_THRESHOLD_': str(512 * 2**20),
    'MALLOC_TOP_PAD_': str(64 * 2**20),
    'OMP_NUM_THREADS': '1',
}

_OUR_PROFILES = {str(LOCALHOST_PROFILE), str(NETWORK_PROFILE)}
_NETWORK_RANGES = {'SUBNET', 'SYSTEM_DEFAULT'}

# glibc reads MALLOC_* at a process's start only; mallopt(3) does the same later.
_MALLOPT = {'MALLOC_TRIM_THRESHOLD_': -1, 'MALLOC_TOP_PAD_': -2, 'MALLOC_MMAP_THRESHOLD_': -3}


def apply_ros_defaults(environ: MutableMapping[str, str] = os.environ) -> None:
    """Set what the user has not set, for this process and its children; before `rclpy.init`.

    A value that is already in the environment always wins; an empty one counts as none. Call it
    again after a change of the discovery range: our own profile follows the range.
    """
    for name, value in ENVIRONMENT.items():
        if not environ.get(name):
            environ[name] = value
    if environ[PROFILE_VARIABLE] in _OUR_PROFILES:
        wide = reaches_network(environ)
        environ[PROFILE_VARIABLE] = str(NETWORK_PROFILE if wide else LOCALHOST_PROFILE)
    _tune_malloc(environ)


def reaches_network(environ: Mapping[str, str] = os.environ) -> bool:
    """Return True if ROS shall find nodes of other machines, as rcl reads these settings."""
    if environ.get('ROS_LOCALHOST_ONLY') == '1':
        return False
    # rcl takes a value that it does not know for LOCALHOST.
    return environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE') in _NETWORK_RANGES


def _tune_malloc(environ: MutableMapping[str, str]) -> None:
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return  # not glibc: nothing to tune
    for name, option in _MALLOPT.items():
        if environ[name].isdecimal():
            # A C int holds less than 2 GiB; glibc would take a larger one as negative.
            mallopt(option, min(int(environ[name]), 2**31 - 1))
