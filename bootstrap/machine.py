"""What this machine has: Pythons, system libraries, rights."""

from __future__ import annotations

import ctypes
import glob
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping

from bootstrap.plan import SUPPORTED, Python, SystemPackage

# The first line takes the current folder off the path: a file `json.py` there is not ours. It
# cannot be -I, which would hide the rclpy of a sourced ROS.
_PROBE = """
import sys; sys.path[:1] == [''] and sys.path.pop(0)
import importlib.util as util, json
print(json.dumps([sys.executable, sys.version_info[:2],
                  util.find_spec('rclpy') is not None, util.find_spec('ensurepip') is not None]))
"""


def clean_environ(environ: Mapping[str, str]) -> dict[str, str]:
    """Return the environment without what another virtual environment left in it.

    The ROS wheels start Python again with their library folders on LD_LIBRARY_PATH and a mark
    that this was done; inherited, both would make our Python load the other one's libraries.
    Empty entries of PYTHONPATH, which mean the current folder, are left out as well.
    """
    clean = {
        name: value
        for name, value in environ.items()
        if name not in ('_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'PYTHONHOME', '__PYVENV_LAUNCHER__')
    }
    if '_ROS_WHEELS_BOOTSTRAP_COMPLETE' in environ:
        folders = environ.get('LD_LIBRARY_PATH', '').split(os.pathsep)
        clean['LD_LIBRARY_PATH'] = os.pathsep.join(
            folder for folder in folders if folder and 'site-packages' not in folder
        )
    if 'PYTHONPATH' in environ:
        folders = environ['PYTHONPATH'].split(os.pathsep)
        clean['PYTHONPATH'] = os.pathsep.join(filter(None, folders))
    return clean


def probe_python(command: str, environ: Mapping[str, str]) -> Python | None:
    """Start an interpreter and return what it is; None when it cannot be started."""
    try:
        answer = subprocess.run(
            [command, '-c', _PROBE],
            env=clean_environ(environ),
            capture_output=True,
            text=True,
            timeout=60,
            check=True,
        )
        executable, version, has_rclpy, has_ensurepip = json.loads(answer.stdout)
    except (OSError, subprocess.SubprocessError, ValueError):
        return None
    return Python(executable, (version[0], version[1]), has_rclpy, has_ensurepip)


def pythons(environ: Mapping[str, str], existing: str | None = None) -> Iterator[Python]:
    """Yield interpreters in the order of preference: the existing environment's, ours, PATH's."""
    wanted = environ.get('JA_PYTHON')
    if wanted:
        commands = [wanted]
    else:
        # 3.12 first: it is the Python of ROS 2 Jazzy's rigs.
        minors = [12, *(m for m in range(SUPPORTED[1][1], SUPPORTED[0][1] - 1, -1) if m != 12)]
        commands = [*([existing] if existing else []), sys.executable]
        commands += [f'python3.{minor}' for minor in minors]
    for command in commands:
        python = probe_python(command, environ)
        if python:
            yield python


def missing_system_packages(python: Python, renders: bool = True) -> list[SystemPackage]:
    """Return the system packages without which the set-up or the sim would fail.

    `renders`: the sim is installed, which needs a graphics library.
    """
    missing = []
    if not python.has_ensurepip:
        name = 'python{}.{}-venv'.format(*python.version)
        missing.append(SystemPackage(name, 'to make the virtual environment', vital=True))
    can_render = (_loads('libEGL.so.1') and _has_gl_driver()) or _loads('libOSMesa.so.8')
    if renders and not can_render:
        missing += [
            SystemPackage(name, 'to render the simulated world without a display')
            for name in ('libegl1', 'libgl1-mesa-dri')
        ]
    return missing


def is_root() -> bool:
    """Return whether this process may install system packages."""
    return os.geteuid() == 0


def has_apt() -> bool:
    """Return whether this system installs packages with apt."""
    return shutil.which('apt-get') is not None


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _has_gl_driver() -> bool:
    patterns = (
        '/usr/lib/*/dri/*_dri.so',
        '/usr/lib*/dri/*_dri.so',
        '/usr/lib/*/libgallium-*.so',
        '/usr/lib*/libEGL_nvidia.so.0',
        '/usr/lib/*/libEGL_nvidia.so.0',
    )
    return any(glob.glob(pattern) for pattern in patterns)
