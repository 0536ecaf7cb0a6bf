"""Message types by name: the class, and the text of its definition.

Names come from recordings and from the graph, so from anybody. A name is looked up among the
installed interface packages alone, before anything of that name is imported or read.
"""

import importlib
import importlib.util
import os
import re
import sys
from functools import cache
from pathlib import Path
from typing import Any

from ja_common.core.config import ConfigError

_SEPARATOR = '=' * 80
# As ROS names them (REP 144 and the style guide of interfaces); a path could not be one.
_TYPE = re.compile(r'(?P<package>[a-z][a-z0-9_]*)/msg/(?P<name>[A-Z][A-Za-z0-9]*)')
# A field's type at the start of a line: `Point32[] points`, `std_msgs/Header header`.
_FIELD = re.compile(r'^\s*(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+\w+', re.MULTILINE)


@cache
def message_class(type_name: str) -> Any:
    """Return the class of `package/msg/Name`. Raises ConfigError when it is not installed."""
    prefixes = {path.parents[3] for path in _definition_files(type_name)}
    package, _, name = type_name.split('/')
    if not any(_python_package(package).is_relative_to(prefix) for prefix in prefixes):
        raise ConfigError(f'the message type {type_name} is not installed for this Python')
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
    return _definition_files(type_name)[0].read_text(encoding='utf-8')


def _definition_files(type_name: str) -> list[Path]:
    """Return the files `PREFIX/share/package/msg/Name.msg`; ConfigError when there is none."""
    if not _TYPE.fullmatch(type_name):
        raise ConfigError(f'{type_name[:100]!r} is no name of a message type')
    # A sourced ROS names its folders; the wheels keep theirs in the environment.
    named = [*os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix]
    prefixes = [Path(prefix) for prefix in named if os.path.isabs(prefix)]
    paths = [prefix / 'share' / f'{type_name}.msg' for prefix in prefixes]
    found = [path for path in paths if path.is_file()]
    if not found:
        places = ', '.join(map(str, prefixes))
        raise ConfigError(f'no share/{type_name}.msg below any of {places}')
    return found


def _python_package(name: str) -> Path:
    """Return where Python would import a package from, without an import."""
    try:
        spec = importlib.util.find_spec(name)
    except (ImportError, ValueError):
        spec = None
    return Path(spec.origin) if spec and spec.origin else Path()


def _inner_types(type_name: str) -> list[str]:
    package = type_name.split('/')[0]
    code = '\n'.join(line.partition('#')[0] for line in _definition(type_name).splitlines())
    inner = []
    for found in _FIELD.finditer(code):
        *other, name = found['type'].split('/')
        if other or name[0].isupper():  # built-in types are in small letters
            inner.append(f'{other[0] if other else package}/msg/{name}')
    return inner


def type_name_of(message_type: Any) -> str:
    """Return the name of a message's class, as the ROS graph has it: `package/msg/Name`."""
    return f'{message_type.__module__.partition(".")[0]}/msg/{message_type.__name__}'
