"""Message types that may be missing: the wheels of ROS lack them, a ROS from apt has them."""

import importlib
import os
from typing import Any


def find_type(type_name: str) -> Any | None:
    """Return the class of `package/msg/Name`; None where it cannot be imported."""
    package, _, name = type_name.split('/')
    try:
        return getattr(importlib.import_module(f'{package}.msg'), name, None)
    except ImportError:
        return None


def how_to_install(*packages: str) -> str:
    """Return how packages of message types are installed on a ROS from apt."""
    distribution = os.environ.get('ROS_DISTRO') or 'jazzy'
    names = (f'ros-{distribution}-{package.replace("_", "-")}' for package in packages)
    return f'apt install {" ".join(names)}'
