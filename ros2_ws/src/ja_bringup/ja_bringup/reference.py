"""The pages docs/topics.md and docs/parameters.md and the SROS2 policy, from the running code.

Every node is started once in a private context, and asked what it hears, says, offers and takes.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.context import Context
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock

from ja_bringup.sros_policy import policy_xml
from ja_common.graph_node import GraphNode
from ja_common.parameters import UNBOUNDED
from ja_common.qos_text import offered_text
from ja_common.rclpy_private import parameter_names
from ja_common.topics import CLOCK, TOPICS
from ja_recording.recording_folder import Channel, Limits, RecordingFolder
from ja_runner.node_spec import NodeSpec

NODES = (
    NodeSpec('ja_perception', 'camera'),
    NodeSpec('ja_perception', 'salient_feature_detector'),
    NodeSpec('ja_control', 'visual_feedback_controller'),
    NodeSpec('ja_learning', 'internal_evaluator'),
    NodeSpec('ja_learning', 'learning_module'),
    NodeSpec('ja_control', 'gate'),
    NodeSpec('ja_sim', 'sim'),
    NodeSpec('ja_sim', 'scorer'),
    NodeSpec('ja_sim', 'digital_head'),
)
COMPANIONS = (
    NodeSpec('ja_dashboard', 'view'),
    NodeSpec('ja_recording', 'recorder'),
    NodeSpec('ja_recording', 'player'),
)
"""Beside the graph, and no part of it: what they hear and say is whatever there is."""

# What the page says of the parameters that `_stand_ins` sets.
_STOOD_IN_FOR = {'source': '(must be given)', 'recording': '(must be given)', 'folder': "''"}
# What rclpy declares by itself on every node.
_NOT_OURS = ('use_sim_time', 'start_type_description_service')

_TOPICS_HEAD = """# Topics and services

Made by `./ja reference` from the code; do not edit. All names are relative (namespaces and remaps
work) but `/clock` and `/diagnostics`. The stamp of an image goes unchanged through everything that
follows from it. Every image gets one message on each topic of the loop, an empty one where there
is nothing to say. Beside the graph, `recorder` hears every topic, `player` says again what was
recorded, and `view` hears what it shows, while somebody looks.

| topic | type | said by | heard by | quality of service (said / heard) | what it is |
|---|---|---|---|---|---|
"""
_SERVICES_HEAD = """
| service | type | offered by |
|---|---|---|
"""
_PARAMETERS_HEAD = """# Parameters

Made by `./ja reference` from the code; do not edit. A whole number is accepted for a float. A bad
value is refused with the reason and changes nothing; *fixed* parameters are read at the start.
"""


def write_reference(folder: Path) -> list[Path]:
    """Write the pages, and the SROS2 policy, into a folder; their paths."""
    with every_node((*NODES, *COMPANIONS)) as nodes:
        pages = {
            'topics.md': topics_page(nodes),
            'parameters.md': parameters_page(nodes),
            'sros2_policy.xml': policy_xml(nodes[: len(NODES)]),
        }
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in pages.items():
        (folder / name).write_text(text, encoding='utf-8')
    return [folder / name for name in pages]


@contextmanager
def every_node(
    specs: Sequence[NodeSpec] = NODES, arguments: Sequence[str] = ()
) -> Iterator[list[GraphNode]]:
    """One of each node, with further ROS arguments, in a private context, until the block ends."""
    context = Context()
    rclpy.init(args=[], context=context)
    cli_args = ['--ros-args', *arguments] if arguments else []
    with TemporaryDirectory() as folder:
        overrides = _stand_ins(Path(folder))
        nodes: list[GraphNode] = []
        try:
            for spec in specs:
                make = spec.load()
                own = overrides.get(spec.executable, [])
                nodes.append(make(context=context, parameter_overrides=own, cli_args=cli_args))
            yield nodes
        finally:
            for node in nodes:
                node.destroy_node()
            context.try_shutdown()


def _stand_ins(folder: Path) -> dict[str, list[Parameter]]:
    """Something to show for the camera, something to play, and a place to record into."""
    cv2.imwrite(str(folder / 'grey.png'), np.full((48, 64, 3), 128, np.uint8))
    recording = RecordingFolder(folder / 'played', Limits())
    clock = Channel(CLOCK.name, 'rosgraph_msgs/msg/Clock', offered_text([CLOCK.publisher_qos]))
    recording.write_message(clock, serialize_message(Clock()), 0, 0, 0)
    recording.close()
    return {
        'camera': [Parameter('source', value=str(folder))],
        'player': [Parameter('recording', value=str(folder / 'played'))],
        'recorder': [Parameter('folder', value=str(folder / 'recorded'))],
    }


def topics_page(nodes: list[GraphNode]) -> str:
    """The table of topics and services, in Markdown."""
    says, hears = defaultdict(list), defaultdict(list)
    services: dict[str, tuple[type, list[str]]] = {}
    for node in nodes:
        for topic in node.published_topics.values():
            says[topic.name].append(node.get_name())
        for topic in node.subscribed_topics.values():
            hears[topic.name].append(node.get_name())
        for name, service in node.advertised_services.items():
            services.setdefault(name.lstrip('/'), (service, []))[1].append(node.get_name())
    rows = [
        f'| `{topic.name}` | {_type_name(topic.type)} | {_names(says[topic.name], nodes)} '
        f'| {_names(hears[topic.name], nodes)} | {_qos(topic.publisher_qos)} / {_qos(topic.subscriber_qos)} '
        f'| {topic.purpose} |\n'
        for topic in TOPICS
    ]
    service_rows = [
        f'| `{name}` | {_type_name(service)} | {_names(offered, nodes)} |\n'
        for name, (service, offered) in sorted(services.items())
    ]
    return _TOPICS_HEAD + ''.join(rows) + _SERVICES_HEAD + ''.join(service_rows)


def parameters_page(nodes: list[GraphNode]) -> str:
    """The tables of parameters, one a node, in Markdown."""
    sections = []
    for node in nodes:
        head = f'\n## {node.get_name()}\n\n| parameter | default | range | what it is |\n'
        rows = []
        for name in parameter_names(node):
            if name.startswith(_NOT_OURS) or name.startswith('qos_overrides'):
                continue
            descriptor = node.describe_parameter(name)
            shown = _default(node, name)
            text = descriptor.description + (' (*fixed*)' if descriptor.read_only else '')
            rows.append(f'| `{name}` | `{shown}` | {_range(descriptor)} | {text} |\n')
        sections.append(head + '|---|---|---|---|\n' + ''.join(rows))
    return _PARAMETERS_HEAD + ''.join(sections)


def _type_name(kind: type) -> str:
    package, _, *_ = kind.__module__.split('.')
    return f'{package}/{kind.__name__}'


def _names(names: list[str], nodes: list[GraphNode]) -> str:
    if len(names) == len(nodes):
        return 'every node'
    return ', '.join(f'`{name}`' for name in names) or '-'


def _qos(profile: QoSProfile) -> str:
    text = f'{profile.reliability.name.lower().replace("_", " ")}, depth {profile.depth}'
    return text + (', latched' if 'LOCAL' in profile.durability.name else '')


def _default(node: GraphNode, name: str) -> str:
    if name in _STOOD_IN_FOR:
        return _STOOD_IN_FOR[name]
    value = node.get_parameter(name).value
    return repr(round(value, 6)) if isinstance(value, float) else repr(value)


def _range(descriptor: ParameterDescriptor) -> str:
    for bounds in (*descriptor.floating_point_range, *descriptor.integer_range):
        low, high = bounds.from_value, bounds.to_value
        if high >= UNBOUNDED:
            return f'from {low:g}'
        return f'up to {high:g}' if low <= -UNBOUNDED else f'{low:g} to {high:g}'
    return ''
