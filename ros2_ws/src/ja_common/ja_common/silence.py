"""Why no message comes on a topic, as far as the ROS graph shows it."""

from collections.abc import Iterator

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ja_common.message_types import type_name_of
from ja_common.ros_defaults import reaches_network
from ja_common.topics import TOPICS, Topic

_COMPRESSED = '/compressed'
_MOST_NAMED = 3


def why_silent(node: Node, name: str, topic: Topic) -> str:
    """Return why a node that subscribes to a topic gets nothing, and what to do.

    `name`: the resolved name of the topic.
    """
    publishers = node.get_publishers_info_by_topic(name)
    if not publishers:
        return _why_unpublished(node, name, topic)
    needed = topic.subscriber_qos
    for publisher in publishers:
        offered = publisher.qos_profile
        if publisher.topic_type != type_name_of(topic.type):
            return (
                f'{publisher.node_name} publishes {publisher.topic_type} there, and '
                f'{type_name_of(topic.type)} is needed'
            )
        if not _match(offered, needed):
            return (
                f'{publisher.node_name} publishes it with a quality of service that does not '
                f'match: {offered.reliability.name} {offered.durability.name} is offered, '
                f'{needed.reliability.name} {needed.durability.name} is needed'
            )
    return f'{publishers[0].node_name} is its publisher, but sends nothing'


def _why_unpublished(node: Node, name: str, topic: Topic) -> str:
    if node.has_parameter('compressed'):
        compressed = name.endswith(_COMPRESSED)
        other = name.removesuffix(_COMPRESSED) if compressed else name + _COMPRESSED
        if published := node.get_publishers_info_by_topic(other):
            return (
                f'{published[0].node_name} publishes only {other}: set the parameter '
                f'compressed:={str(not compressed).lower()}'
            )
    domain = node.context.get_domain_id()
    where = 'of the network' if reaches_network() else 'of this machine alone'
    sentence = f'no node publishes it, in ROS_DOMAIN_ID {domain} {where}'
    if not reaches_network():
        sentence += ' (ROS_AUTOMATIC_DISCOVERY_RANGE)'
    if others := list(_same_type(node, topic))[:_MOST_NAMED]:
        sentence += (
            f'; of its type there is {", ".join(others)}: remap with -r {topic.name}:={others[0]}'
        )
    return sentence


def _same_type(node: Node, topic: Topic) -> Iterator[str]:
    """Yield the published topics of a topic's type that are not of this project."""
    ours = {node.resolve_topic_name(known.name) for known in TOPICS}
    wanted = type_name_of(topic.type)
    for name, types in node.get_topic_names_and_types():
        if wanted in types and name not in ours and node.count_publishers(name):
            yield name


def _match(offered: QoSProfile, needed: QoSProfile) -> bool:
    """Return whether a publisher offers at least the quality of service that is needed."""
    lossy = offered.reliability is ReliabilityPolicy.BEST_EFFORT
    forgets = offered.durability is DurabilityPolicy.VOLATILE
    return not (
        (lossy and needed.reliability is ReliabilityPolicy.RELIABLE)
        or (forgets and needed.durability is DurabilityPolicy.TRANSIENT_LOCAL)
    )
