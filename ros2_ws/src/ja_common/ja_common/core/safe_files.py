"""Read files that anybody may have written.

A folder, a pipe, a device, a file without end, text in another encoding, YAML that expands to more
than the memory: each ends in a ConfigError of one sentence that names the file.
"""

import json
import os
import stat
from pathlib import Path
from typing import Any

import yaml

from ja_common.core.config import ConfigError

LARGEST_TEXT_BYTES = 2**20
"""A text that is longer is not parsed; the longest of ours has some thousand bytes."""

_DEEPEST = 30


def read_bytes(path: Path, largest_bytes: int) -> bytes:
    """Return the content of a regular file. Raises ConfigError when it is none, or is larger."""
    try:
        _check_regular(path, os.stat(path))
        # Between the two checks the file may become a pipe: it must not block.
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), 'rb') as file:
            _check_regular(path, os.fstat(file.fileno()))
            content = file.read(largest_bytes + 1)
    except FileNotFoundError:
        raise ConfigError(f'{path} cannot be read: there is no such file') from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        if isinstance(error, ConfigError):
            raise
        why = getattr(error, 'strerror', None) or error
        raise ConfigError(f'{path} cannot be read: {why}') from None
    if len(content) > largest_bytes:
        raise ConfigError(f'{path} is larger than the {largest_bytes} bytes that are read')
    return content


def read_text(path: Path, largest_bytes: int = LARGEST_TEXT_BYTES) -> str:
    """Return the content of a file in UTF-8, as `read_bytes`."""
    try:
        return read_bytes(path, largest_bytes).decode('utf-8-sig')
    except UnicodeDecodeError as error:
        raise ConfigError(f'{path} is no text in UTF-8: {error.reason} at {error.start}') from None


def load_yaml(path: Path) -> dict[str, Any]:
    """Return the table that a YAML file holds; an empty file is an empty table.

    Raises ConfigError with the file and the line of what is wrong.
    """
    text = read_text(path)
    table = construct_yaml(compose_yaml(text, str(path)), str(path))
    if table is None:
        return {}
    if not isinstance(table, dict) or not all(isinstance(key, str) for key in table):
        raise ConfigError(f'{path} must hold a table of settings (name: value)')
    return table


def parse_yaml(text: str, where: str) -> Any:
    """Return what a YAML text holds. `where` it comes from begins a ConfigError."""
    if len(text) > LARGEST_TEXT_BYTES:
        raise ConfigError(f'{where} is longer than the {LARGEST_TEXT_BYTES} bytes that are read')
    return construct_yaml(compose_yaml(text, where), where)


def compose_yaml(text: str, where: str) -> yaml.Node | None:
    """Return the nodes of a YAML text, which know their lines; None for an empty text.

    What can expand without bound, or be read in two ways, is refused: aliases, tags, the same key
    twice, deep nesting. Raises ConfigError that begins with `where` and the line.
    """
    try:
        return _StrictLoader(text).get_single_node()
    except yaml.MarkedYAMLError as error:
        line = f':{error.problem_mark.line + 1}' if error.problem_mark else ''
        raise ConfigError(f'{where}{line}: not YAML: {error.problem}') from None
    except (yaml.YAMLError, ValueError) as error:
        raise ConfigError(f'{where}: not YAML: {_first_line(error)}') from None


def construct_yaml(node: yaml.Node | None, where: str) -> Any:
    """Return the value of a node of `compose_yaml`; None for None. Raises ConfigError."""
    if node is None:
        return None
    try:
        return _StrictLoader('').construct_document(node)
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # 2026-99-99, 10^5000
        line = node.start_mark.line + 1
        raise ConfigError(f'{where}:{line}: no value of YAML: {_first_line(error)}') from None


def load_json(path: Path, largest_bytes: int = LARGEST_TEXT_BYTES) -> dict[str, Any]:
    """Return the object that a JSON file holds. Raises ConfigError."""
    text = read_text(path, largest_bytes)
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError(f'{path} is not JSON: {_first_line(error)}') from None
    if not isinstance(found, dict):
        raise ConfigError(f'{path} must hold one JSON object')
    return found


class _StrictLoader(yaml.SafeLoader):
    """A SafeLoader of plain tables, lists and values."""

    _depth = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event = self.peek_event()
        if isinstance(event, yaml.AliasEvent):
            raise _refused(f'an alias (*{event.anchor}): write the value again', event)
        if event.tag is not None:
            raise _refused(f'a tag ({event.tag}): leave it out', event)
        self._depth += 1
        if self._depth > _DEEPEST:
            raise _refused(f'nested deeper than {_DEEPEST}', event)
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def compose_mapping_node(self, anchor: Any) -> yaml.MappingNode:
        node = super().compose_mapping_node(anchor)
        keys = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise _refused('a key that is no word', key)
            if key.value in keys:
                raise _refused(f'{key.value[:100]!r} is given twice', key)
            keys.add(key.value)
        return node


def _refused(problem: str, place: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=place.start_mark)


def _first_line(error: Exception) -> str:
    return str(error).partition('\n')[0][:200]


def _check_regular(path: Path, status: os.stat_result) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise ConfigError(f'{path} is a folder; a file is needed')
    if not stat.S_ISREG(status.st_mode):
        raise ConfigError(f'{path} is a pipe, a socket or a device; a regular file is needed')
