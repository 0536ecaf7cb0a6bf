"""The sections of ROS parameter files and of `-p`, and the nodes that they are for, as in rcl."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from ja_common.core.config import ConfigError
from ja_common.core.safe_files import load_yaml

_PARAMETERS = 'ros__parameters'
_FILE_OPTION = '--params-file'
_VALUE_OPTIONS = ('-p', '--param')
# One part of a node's name in a section -> what it stands for.
_WILDCARDS = {'**': r'(/\w+)*', '*': r'/\w+'}


@dataclass(frozen=True)
class ParameterSection:
    """The parameters that one section of a file, or one `-p`, has for the nodes of a pattern."""

    source: str
    nodes: str
    names: tuple[str, ...]

    def is_for(self, node: str) -> bool:
        """Return whether a node of this full name (`/left/gate`) gets these parameters."""
        parts = self.nodes.strip('/').split('/')
        pattern = ''.join(_WILDCARDS.get(part, '/' + re.escape(part)) for part in parts)
        return re.fullmatch(pattern, node) is not None

    @property
    def is_shared(self) -> bool:
        """Return whether it is for nodes of any name, such as `/**`."""
        return self.node_name in _WILDCARDS

    @property
    def node_name(self) -> str:
        """Return the last part of the pattern: the name of the node without its namespace."""
        return self.nodes.rpartition('/')[2]

    def __str__(self) -> str:
        return f'section {self.nodes} of {self.source}' if self.is_of_file else self.source

    @property
    def is_of_file(self) -> bool:
        """Return whether it stands in a file, and not on the command line."""
        return not self.source.startswith(_VALUE_OPTIONS)


def parameter_sections(arguments: Sequence[str]) -> list[ParameterSection]:
    """Return the sections of all parameter files, and of each `-p`, of ROS arguments.

    `arguments` are those that rcl accepts, without `--ros-args`. Raises ConfigError for a file
    that cannot be read.
    """
    sections: list[ParameterSection] = []
    for option, value in pairwise(arguments):
        if option == _FILE_OPTION:
            sections += _sections_of_table(value, load_yaml(Path(value)))
        elif option in _VALUE_OPTIONS:
            name = value.partition(':=')[0]
            node, colon, name = name.rpartition(':')
            sections.append(
                ParameterSection(f'{option} {value}', f'/{node}' if colon else '/**', (name,))
            )
    return sections


def _sections_of_table(
    source: str, table: Mapping[str, Any], namespace: str = ''
) -> Iterator[ParameterSection]:
    for key, value in table.items():
        nodes = f'{namespace}/{key.strip("/")}'
        if not isinstance(value, dict):
            raise ConfigError(
                f'{source}: {nodes.strip("/")} stands outside of a section: write NODE: or /**:, '
                f'below it {_PARAMETERS}:, and below that the parameters'
            )
        if _PARAMETERS in value:
            yield ParameterSection(source, nodes, tuple(_names(value[_PARAMETERS] or {})))
        yield from _sections_of_table(
            source, {name: inner for name, inner in value.items() if name != _PARAMETERS}, nodes
        )


def _names(parameters: Any, prefix: str = '') -> Iterator[str]:
    """Yield the names of nested parameters as ROS has them, joined by dots."""
    for name, value in parameters.items() if isinstance(parameters, dict) else ():
        if isinstance(value, dict):
            yield from _names(value, f'{prefix}{name}.')
        else:
            yield f'{prefix}{name}'
