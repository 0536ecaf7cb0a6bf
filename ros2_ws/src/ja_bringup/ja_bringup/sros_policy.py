"""The SROS2 policy: what each node may say, hear, offer and ask, made from the running nodes.

The same declarations as `docs/topics.md`; nothing is allowed that no node has declared. Names are
those of a graph without namespace and remaps. Its use, and what was not tried: docs/safety.md.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Mapping

from ja_common.graph_node import GraphNode
from ja_common.topics import CLOCK, FORWARD_COMMANDS, JOINT_TRAJECTORY, LOG, ROBOT_DESCRIPTION

# By configuration, so that a running default node does not show it.
_BY_CONFIGURATION: Mapping[str, tuple[set[str], set[str]]] = {
    'gate': ({JOINT_TRAJECTORY.name, FORWARD_COMMANDS.name}, {ROBOT_DESCRIPTION.name}),
}
# What rclpy itself gives every node (`~/` is the node's own name).
_SAID_BY_ALL = (LOG.name.lstrip('/'), 'parameter_events')
_HEARD_BY_ALL = (CLOCK.name.lstrip('/'), 'parameter_events')
_OFFERED_BY_ALL = (
    'describe_parameters',
    'get_parameter_types',
    'get_parameters',
    'get_type_description',
    'list_parameters',
    'set_parameters',
    'set_parameters_atomically',
)


def policy_xml(nodes: Iterable[GraphNode]) -> str:
    """The policy of these nodes, one enclave each, as `ros2 security` reads it."""
    policy = ElementTree.Element('policy', version='0.2.0')
    enclaves = ElementTree.SubElement(policy, 'enclaves')
    for node in nodes:
        name = node.get_name()
        more_said, more_heard = _BY_CONFIGURATION.get(name, (set(), set()))
        enclave = ElementTree.SubElement(enclaves, 'enclave', path=f'/{name}')
        profiles = ElementTree.SubElement(enclave, 'profiles')
        profile = ElementTree.SubElement(profiles, 'profile', ns='/', node=name)
        said = {_bare(topic) for topic in node.published_topics} | more_said | {*_SAID_BY_ALL}
        heard = {_bare(topic) for topic in node.subscribed_topics} | more_heard | {*_HEARD_BY_ALL}
        offered = {_bare(service) for service in node.advertised_services}
        offered |= {f'{name}/{service}' for service in _OFFERED_BY_ALL}
        _allow(profile, 'topics', 'publish', 'topic', said)
        _allow(profile, 'topics', 'subscribe', 'topic', heard)
        _allow(profile, 'services', 'reply', 'service', offered)
    ElementTree.indent(policy)
    return ElementTree.tostring(policy, encoding='unicode', xml_declaration=True) + '\n'


def _bare(resolved: str) -> str:
    return resolved.lstrip('/')


def _allow(
    profile: ElementTree.Element, group: str, verb: str, tag: str, names: Iterable[str]
) -> None:
    element = ElementTree.SubElement(profile, group, {verb: 'ALLOW'})
    for name in sorted(names):
        ElementTree.SubElement(element, tag).text = name
