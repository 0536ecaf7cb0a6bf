"""The SROS2 policy: the topics and services of each node, made from the running nodes.

The same declarations as `docs/topics.md`; only what a node has declared is allowed. Names are
those of a graph without namespace and remaps. docs/safety.md says how to use it, and what was not
tried.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Mapping

from ja_common.graph_node import GraphNode
from ja_common.topics import CLOCK, FORWARD_COMMANDS, JOINT_TRAJECTORY, LOG, ROBOT_DESCRIPTION

# Topics of other configurations, which a node with its defaults does not declare.
_BY_CONFIGURATION: Mapping[str, tuple[set[str], set[str]]] = {
    'gate': ({JOINT_TRAJECTORY.name, FORWARD_COMMANDS.name}, {ROBOT_DESCRIPTION.name}),
}
# What rclpy itself adds to every node (`~/` is the node's own name).
_PUBLISHED_BY_ALL = (LOG.name.lstrip('/'), 'parameter_events')
_SUBSCRIBED_BY_ALL = (CLOCK.name.lstrip('/'), 'parameter_events')
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
    """Return the policy of these nodes, one enclave each, as `ros2 security` reads it."""
    policy = ElementTree.Element('policy', version='0.2.0')
    enclaves = ElementTree.SubElement(policy, 'enclaves')
    for node in nodes:
        name = node.get_name()
        more_published, more_subscribed = _BY_CONFIGURATION.get(name, (set(), set()))
        enclave = ElementTree.SubElement(enclaves, 'enclave', path=f'/{name}')
        profiles = ElementTree.SubElement(enclave, 'profiles')
        profile = ElementTree.SubElement(profiles, 'profile', ns='/', node=name)
        published = (
            {_bare(topic) for topic in node.published_topics}
            | more_published
            | {*_PUBLISHED_BY_ALL}
        )
        subscribed = (
            {_bare(topic) for topic in node.subscribed_topics}
            | more_subscribed
            | {*_SUBSCRIBED_BY_ALL}
        )
        offered = {_bare(service) for service in node.advertised_services}
        offered |= {f'{name}/{service}' for service in _OFFERED_BY_ALL}
        _allow(profile, 'topics', 'publish', 'topic', published)
        _allow(profile, 'topics', 'subscribe', 'topic', subscribed)
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
