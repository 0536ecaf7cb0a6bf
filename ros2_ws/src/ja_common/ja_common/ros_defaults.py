"""The ROS defaults of every entry point. Why each is there: docs/ros_defaults.md."""

import ctypes
import os
from collections.abc import Mapping, MutableMapping
from importlib.resources import files

LOCALHOST_PROFILE = files('ja_common') / 'fastdds_localhost.xml'
NETWORK_PROFILE = files('ja_common') / 'fastdds_network.xml'
LEASE_S = 2.0
"""In both profiles: after this silence [s] other nodes take a node for dead."""

_PROFILE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
ENVIRONMENT = {
    'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
    _PROFILE: str(LOCALHOST_PROFILE),
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
    if environ[_PROFILE] in _OUR_PROFILES:
        wide = reaches_network(environ)
        environ[_PROFILE] = str(NETWORK_PROFILE if wide else LOCALHOST_PROFILE)
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
