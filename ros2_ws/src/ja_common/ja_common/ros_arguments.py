"""ROS arguments of a command line: written, split off from ours, checked."""

from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from ja_common.core.config import ConfigError
from ja_common.private_context import private_context
from ja_common.rclpy_private import RCLError, UnknownROSArgsError


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
    try:
        with private_context(arguments):
            pass
    except UnknownROSArgsError as error:
        raise ConfigError(f'unknown ROS arguments: {error}') from None
    except RCLError as error:
        # "failed to initialize rcl: WHAT, at FILE:LINE, at ..."
        what = str(error).removeprefix('failed to initialize rcl: ').split(', at ')[0]
        raise ConfigError(f'ROS arguments: {what}') from None
