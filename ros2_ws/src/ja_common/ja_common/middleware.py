"""Whether rclpy and its middleware can be loaded, found out in another process.

rcl ends the process that imports rclpy when the middleware of RMW_IMPLEMENTATION is not installed.
"""

import os
import re
import subprocess
from functools import cache
from typing import NamedTuple

from ja_common.core.config import ConfigError
from ja_common.python_command import code_command

TESTED = 'rmw_fastrtps_cpp'

_PROBE = """
import rclpy
print(rclpy.__file__)
print(rclpy.get_rmw_implementation_identifier())
"""
# `[ERROR] [1795953187.19] [rcl]: WHAT, at FILE:LINE`
_LOGGED = re.compile(r'(\[\w+\] )+\[[\d.]+\] \[\w+\]: (?P<what>.*?)(, exiting with .*|, at /.*)?')


class Middleware(NamedTuple):
    """The file of rclpy and the name of its middleware; `error`: why they cannot be loaded."""

    rclpy: str
    name: str
    error: str


@cache
def load_middleware() -> Middleware:
    """Return what another process finds that imports rclpy."""
    found = subprocess.run(code_command(_PROBE), capture_output=True, text=True, check=False)
    lines = found.stdout.split('\n')
    if found.returncode == 0:
        return Middleware(lines[0], lines[1], '')
    said = [line for line in found.stderr.splitlines() if line.strip()]
    last = said[-1] if said else f'exit code {found.returncode}'
    logged = _LOGGED.fullmatch(last)
    return Middleware('', '', logged['what'] if logged else last)


def check_middleware() -> None:
    """Raise ConfigError when RMW_IMPLEMENTATION names a middleware that cannot be loaded."""
    wanted = os.environ.get('RMW_IMPLEMENTATION')
    if wanted and wanted != TESTED and (error := load_middleware().error):
        raise ConfigError(
            f'RMW_IMPLEMENTATION={wanted} cannot be loaded ({error}): install it for this ROS, or '
            f'unset RMW_IMPLEMENTATION ({TESTED} comes with this project)'
        )
