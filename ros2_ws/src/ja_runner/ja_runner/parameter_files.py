"""Refuse parameter files for other nodes than those of the graph, before anything starts."""

from collections.abc import Iterator, Sequence
from itertools import groupby

from ja_common.core.config import ConfigError
from ja_common.core.parameter_page import project_parameters
from ja_common.core.parameter_sections import ParameterSection, parameter_sections
from ja_common.core.unread_parameters import suggestion


def check_parameter_files(nodes: Sequence[str], arguments: Sequence[str]) -> list[str]:
    """Return a sentence for each parameter that none of these nodes gets.

    `nodes`: full names, such as `/left/gate`. `arguments`: the ROS arguments of all nodes. Raises
    ConfigError for a file, or a `-p NODE:NAME:=VALUE`, that is for none of them.
    """
    sentences: list[str] = []
    for source, group in groupby(parameter_sections(arguments), lambda section: section.source):
        sections = list(group)
        foreign = [each for each in sections if not any(map(each.is_for, nodes))]
        if len(foreign) == len(sections):
            patterns = ', '.join(section.nodes for section in sections)
            raise ConfigError(
                f'{source} is for none of the nodes that run: it is for {patterns}; '
                f'the nodes are {", ".join(nodes)}; /**/NAME is for NAME in any namespace'
            )
        sentences += [
            f'{section} is for no node of this graph{_nearest(section, nodes)}'
            for section in foreign
        ]
        for section in sections:
            if section.is_shared:
                sentences += _without_node(section, nodes)
    return sentences


def _nearest(section: ParameterSection, nodes: Sequence[str]) -> str:
    names = {node.rpartition('/')[2]: node for node in nodes}
    if section.node_name in names:
        return f': is {names[section.node_name]} meant?'
    return suggestion(section.node_name, names)


def _without_node(section: ParameterSection, nodes: Sequence[str]) -> Iterator[str]:
    """Yield a sentence for each parameter for all nodes that none of these has."""
    running = {node.rpartition('/')[2] for node in nodes}
    project = project_parameters()
    if not running <= project.keys():
        return  # the parameters of nodes of other packages are not known
    everywhere = {name for names in project.values() for name in names}
    for name in section.names:
        owners = [node for node, names in project.items() if name in names]
        if not owners:
            yield f'{section}: no node has a parameter {name}{suggestion(name, everywhere)}'
        elif not running & set(owners):
            yield f'{section}: no node of this graph has {name}, only {", ".join(owners)}'
