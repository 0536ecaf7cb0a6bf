"""Parameters that reach no node: a misspelt name, or a section for a node of another name."""

import difflib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from ja_common.core.parameter_sections import ParameterSection

ParameterNames = Mapping[str, Collection[str]]
"""The parameters of every node of the project, by the name of its executable."""


class UnreadParameter(NamedTuple):
    """A parameter that a node was given and does not have, in a sentence.

    `is_foreign`: it is for all nodes and like no name of ours, so likely for a node of others.
    """

    sentence: str
    is_foreign: bool = False


def unread_parameters(
    node: str,
    declared: Collection[str],
    overridden: Iterable[str],
    sections: Sequence[ParameterSection],
    project: ParameterNames,
) -> Iterator[UnreadParameter]:
    """Yield each parameter that was written for a node, and that it does not take.

    `node`: its full name. `declared`: the parameters that it has. `overridden`: those that it was
    given. A shared section (`/**`) may hold the parameters of any node: there only a name that no
    node of the project has is misspelt, and the node whose own name is the nearest reports it.
    """
    ours = [section for section in sections if section.is_for(node)]
    shared = {name for section in ours if section.is_shared for name in section.names}
    shared -= {name for section in ours if not section.is_shared for name in section.names}
    everywhere = {name for names in project.values() for name in names} | set(declared)
    for name in sorted(set(overridden) - set(declared)):
        if name not in shared:
            yield UnreadParameter(
                f'{node} has no parameter {name}{_where(name, ours)}{suggestion(name, declared)}'
            )
        elif name not in everywhere:
            (nearest,) = difflib.get_close_matches(name, everywhere, 1) or ['']
            if not nearest or nearest in declared:
                yield UnreadParameter(
                    f'no node has a parameter {name}{_where(name, ours)}'
                    f'{suggestion(name, everywhere)}',
                    is_foreign=not nearest,
                )
    if all(section.is_shared for section in ours):
        for section in sections:
            if section not in ours and _is_meant_for(node, declared, section, project):
                yield UnreadParameter(
                    f'{section} is not for this node: its name is {node}, and /** is for any'
                )


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return `: is NEAREST meant?`, or '' when no known name is near."""
    nearest = difflib.get_close_matches(name, known, 1)
    return f': is {nearest[0]} meant?' if nearest else ''


def _where(name: str, sections: Iterable[ParameterSection]) -> str:
    places = [str(section) for section in sections if name in section.names]
    return f' ({", ".join(places)})' if places else ''


def _is_meant_for(
    node: str, declared: Collection[str], section: ParameterSection, project: ParameterNames
) -> bool:
    """Return whether a section for another name holds mostly parameters that this node has.

    One of them must be a parameter that no other node of the project has.
    """
    name = node.rpartition('/')[2]
    if section.node_name != name and section.node_name in project:
        return False
    elsewhere = {known for other, names in project.items() if other != name for known in names}
    taken = [known for known in section.names if known in declared]
    return len(taken) * 2 > len(section.names) and any(each not in elsewhere for each in taken)
