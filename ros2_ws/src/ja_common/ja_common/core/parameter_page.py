"""What the page `parameters.md` states about the parameters of every node.

`./ja reference` writes the page; this package carries a copy, so that a node knows the names of
the others' parameters, and its own before it is made, without importing any of them.
"""

import re
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

PAGE = Path(str(files('ja_common'))) / 'parameters.md'

OF_EVERY_NODE = ('use_sim_time', 'start_type_description_service')
"""Parameters that rclpy itself declares; the page leaves them out."""

_ROW = re.compile(r'\| `(?P<name>.*?)` \| `(?P<default>.*?)` \| (?P<range>.*?) \| (?P<text>.*) \|')


class ParameterRow(NamedTuple):
    """One parameter: texts as on the page."""

    name: str
    default: str
    range: str
    text: str


@cache
def parameter_page(path: Path = PAGE) -> dict[str, tuple[ParameterRow, ...]]:
    """Return the parameters of every node, by the name of its executable."""
    page: dict[str, list[ParameterRow]] = {}
    for line in path.read_text(encoding='utf-8').splitlines():
        if line.startswith('## '):
            rows = page.setdefault(line.removeprefix('## '), [])
        elif found := _ROW.fullmatch(line):
            rows.append(ParameterRow(**found.groupdict()))
    return {node: tuple(rows) for node, rows in page.items()}


def project_parameters() -> dict[str, frozenset[str]]:
    """Return the names of every node's parameters, those that rclpy declares included."""
    return {
        node: frozenset([*OF_EVERY_NODE, *(row.name for row in rows)])
        for node, rows in parameter_page().items()
    }
