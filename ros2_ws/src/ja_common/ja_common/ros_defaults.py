"""The ROS defaults of every entry point. Why each is there: docs/ros_defaults.md."""

import ctypes
import os
from collections.abc import MutableMapping
from importlib.resources import files

PROFILE = files('ja_common') / 'fastdds_profile.xml'
LEASE_S = 2.0
"""In the profile: after this silence [s] other nodes take a node for dead."""

ENVIRONMENT = {
    'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
    'FASTRTPS_DEFAULT_PROFILES_FILE': str(PROFILE),
    'MALLOC_MMAP_THRESHOLD_': str(32 * 2**20),
    'MALLOC_TRIM_THRESHOLD_': str(512 * 2**20),
    'MALLOC_TOP_PAD_': str(64 * 2**20),
    'OMP_NUM_THREADS': '1',
}

# glibc reads MALLOC_* at a process's start only; mallopt(3) does the same later.
_MALLOPT = {'MALLOC_TRIM_THRESHOLD_': -1, 'MALLOC_TOP_PAD_': -2, 'MALLOC_MMAP_THRESHOLD_': -3}


def apply_ros_defaults(environ: MutableMapping[str, str] = os.environ) -> None:
    """Set what the user has not set, for this process and its children; before `rclpy.init`.

    A value that is already in the environment always wins. Calling it again changes nothing.
    """
    for name, value in ENVIRONMENT.items():
        environ.setdefault(name, value)
    _tune_malloc(environ)


def _tune_malloc(environ: MutableMapping[str, str]) -> None:
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return  # not glibc: nothing to tune
    for name, option in _MALLOPT.items():
        if environ[name].isdecimal():
            # A C int holds less than 2 GiB; glibc would take a larger one as negative.
            mallopt(option, min(int(environ[name]), 2**31 - 1))
