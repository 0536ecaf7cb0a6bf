"""ROS arguments of a command line: written, split off from ours, checked.

Only a check imports rclpy: `./ja doctor` also runs where rclpy cannot be imported.
"""

import os
from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from ja_common.core.config import ConfigError

LARGEST_DOMAIN_ID = 232
"""Above it the ports of RTPS, 7400 + 250 * id, would be larger than 65535."""

SAFE_DOMAIN_ID = 101
"""Up to it the ports of RTPS lie below those that Linux gives to any program."""


def parameter_arguments(parameters: Mapping[str, Any]) -> list[str]:
    """Parameters as ROS arguments: `-p NAME:=VALUE`, one after the other."""
    arguments: list[str] = []
    for name, value in parameters.items():
        # YAML's flow style is what rcl reads after `:=`.
        text = yaml.safe_dump(value, default_flow_style=True, width=10**6)
        arguments += ['-p', f'{name}:={text.strip().removesuffix("...").strip()}']
    return arguments


def split_ros_arguments(argv: Sequence[str]) -> tuple[list[str], list[str]]:
    """Command line -> (ours, ROS's without `--ros-args`); ROS's end at `--` or at the end."""
    ours: list[str] = []
    ros: list[str] = []
    in_ros = False
    for argument in argv:
        if argument == '--ros-args':
            in_ros = True
        elif in_ros and argument == '--':
            in_ros = False
        else:
            (ros if in_ros else ours).append(argument)
    return ours, ros


def check_ros_arguments(arguments: Sequence[str]) -> None:
    """Raise ConfigError with one sentence for arguments that no node would understand."""
    from ja_common.private_context import private_context
    from ja_common.rclpy_private import RCLError, UnknownROSArgsError

    domain_id()
    try:
        with private_context(arguments):
            pass
    except UnknownROSArgsError as error:
        raise ConfigError(f'unknown ROS arguments: {error}') from None
    except RCLError as error:
        raise ConfigError(f'ROS arguments: {rcl_sentence(error)}') from None


def rcl_sentence(error: RuntimeError) -> str:
    """Return what an error of `rclpy.init` says, without the places in the source of rcl."""
    # "failed to initialize rcl: WHAT, at FILE:LINE, at ..."
    return str(error).removeprefix('failed to initialize rcl: ').split(', at /')[0]


def domain_id(environ: Mapping[str, str] = os.environ) -> int:
    """Return the ROS_DOMAIN_ID. Raises ConfigError when it is no number, or has no ports."""
    text = environ.get('ROS_DOMAIN_ID') or '0'
    if not (text.isascii() and text.isdecimal() and int(text) <= LARGEST_DOMAIN_ID):
        raise ConfigError(
            f'ROS_DOMAIN_ID is {text!r}: it must be a whole number from 0 to {LARGEST_DOMAIN_ID}, '
            f'and above {SAFE_DOMAIN_ID} its ports collide with those that the system gives away'
        )
    return int(text)
