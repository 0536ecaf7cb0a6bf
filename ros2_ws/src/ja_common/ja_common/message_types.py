"""Message types by name: the class, and the text of its definition."""

import importlib
import os
import re
import sys
from functools import cache
from pathlib import Path
from typing import Any

from ja_common.core.config import ConfigError

_SEPARATOR = '=' * 80
# A field's type at the start of a line: `Point32[] points`, `std_msgs/Header header`.
_FIELD = re.compile(r'^\s*(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+\w+', re.MULTILINE)


def message_class(type_name: str) -> Any:
    """Return the class of `package/msg/Name`. Raises ConfigError when it is not installed."""
    package, _, name = type_name.partition('/msg/')
    try:
        return getattr(importlib.import_module(f'{package}.msg'), name)
    except (ImportError, AttributeError):
        raise ConfigError(f'the message type {type_name} is not installed') from None


@cache
def schema_of(type_name: str) -> str:
    """Return the definition of a type, then those of all types in it (encoding `ros2msg`).

    Raises ConfigError when a definition is not installed.
    """
    parts = [_definition(type_name)]
    known = {type_name}
    waiting = _inner_types(type_name)
    while waiting:
        inner = waiting.pop(0)
        if inner not in known:
            known.add(inner)
            waiting += _inner_types(inner)
            package, name = inner.split('/msg/')
            parts.append(f'{_SEPARATOR}\nMSG: {package}/{name}\n{_definition(inner)}')
    return '\n'.join(parts)


@cache
def _definition(type_name: str) -> str:
    # A sourced ROS names its folders; the wheels keep theirs in the environment.
    prefixes = [*os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix]
    for prefix in filter(None, prefixes):
        path = Path(prefix, 'share', f'{type_name}.msg')
        if path.is_file():
            return path.read_text(encoding='utf-8')
    raise ConfigError(f'no share/{type_name}.msg below any of {", ".join(filter(None, prefixes))}')


def _inner_types(type_name: str) -> list[str]:
    package = type_name.split('/')[0]
    code = '\n'.join(line.partition('#')[0] for line in _definition(type_name).splitlines())
    inner = []
    for found in _FIELD.finditer(code):
        *other, name = found['type'].split('/')
        if other or name[0].isupper():  # built-in types are in small letters
            inner.append(f'{other[0] if other else package}/msg/{name}')
    return inner
