"""The pages docs/topics.md and docs/parameters.md and the SROS2 policy, from the running code.

Every node is started once in a private context; its topics, services and parameters are listed.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock

from ja_bringup.sros_policy import policy_xml
from ja_common.core.files import check_writable, write_file
from ja_common.core.parameter_page import OF_EVERY_NODE, PAGE
from ja_common.graph_node import GraphNode
from ja_common.parameters import READ_ONLY, UNBOUNDED
from ja_common.private_context import private_context
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
    NodeSpec('ja_caregiver', 'request_scorer'),
)
COMPANIONS = (
    NodeSpec('ja_dashboard', 'view'),
    NodeSpec('ja_dashboard', 'markers'),
    NodeSpec('ja_control', 'head_frames'),
    NodeSpec('ja_recording', 'recorder'),
    NodeSpec('ja_recording', 'player'),
)
"""Nodes beside the graph: they subscribe to and publish any topic that there is."""

# What the page shows for the parameters that `_placeholders` sets.
_SHOWN_FOR_PLACEHOLDER = {
    'source': '(must be given)',
    'recording': '(must be given)',
    'folder': "''",
}

_TOPICS_HEAD = """# Topics and services

Made by `./ja reference` from the code; do not edit. All names are relative (namespaces and remaps
work) except `/clock` and `/diagnostics`. All messages that follow from an image carry its stamp
unchanged. Every image gets one message on each topic of the loop, an empty one where there is no
result. Beside the graph, `recorder` subscribes to every topic, `player` publishes what was
recorded, `view` subscribes to what it shows while the page is open, and `markers` to what it draws
while `markers` has a subscriber.

| topic | type | publishers | subscribers | QoS (publishers / subscribers) | what it is |
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
    """Write the pages and the SROS2 policy into a folder; return their paths."""
    check_writable(folder)
    with every_node((*NODES, *COMPANIONS)) as nodes:
        pages = {
            'topics.md': topics_page(nodes),
            'parameters.md': parameters_page(nodes),
            'sros2_policy.xml': policy_xml(nodes[: len(NODES)]),
        }
    for name, text in pages.items():
        write_file(folder / name, text)
    return [folder / name for name in pages]


def copy_into_package(folder: Path) -> Path:
    """Copy the page of parameters to where the nodes read it (`core.parameter_page`)."""
    write_file(PAGE, (folder / 'parameters.md').read_text())
    return PAGE


@contextmanager
def every_node(
    specs: Sequence[NodeSpec] = NODES, arguments: Sequence[str] = ()
) -> Iterator[list[GraphNode]]:
    """Start one of each node, with further ROS arguments, in a private context for the block."""
    cli_args = ['--ros-args', *arguments] if arguments else []
    with private_context() as context, TemporaryDirectory() as folder:
        overrides = _placeholders(Path(folder))
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


def _placeholders(folder: Path) -> dict[str, list[Parameter]]:
    """Make an image for the camera, a recording for the player, a folder for the recorder."""
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
    """Return the tables of topics and services, in Markdown."""
    publishers, subscribers = defaultdict(list), defaultdict(list)
    services: dict[str, tuple[type, list[str]]] = {}
    new_names: dict[str, str] = {}
    for node in nodes:
        for topic in node.published_topics.values():
            publishers[topic.name].append(node.get_name())
        for topic in node.subscribed_topics.values():
            subscribers[topic.name].append(node.get_name())
        for name, service in node.advertised_services.items():
            services.setdefault(name.lstrip('/'), (service, []))[1].append(node.get_name())
        new_names |= {old.lstrip('/'): new for old, new in node.renamed_services.items()}
    rows = [
        f'| `{topic.name}` | {_type_name(topic.type)} | {_names(publishers[topic.name], nodes)} '
        f'| {_names(subscribers[topic.name], nodes)} '
        f'| {_qos(topic.publisher_qos)} / {_qos(topic.subscriber_qos)} '
        f'| {topic.purpose} |\n'
        for topic in TOPICS
    ]
    service_rows = [
        f'| `{name}`{_old_name(new_names.get(name))} | {_type_name(service)} '
        f'| {_names(offered, nodes)} |\n'
        for name, (service, offered) in sorted(services.items())
    ]
    return _TOPICS_HEAD + ''.join(rows) + _SERVICES_HEAD + ''.join(service_rows)


def parameters_page(nodes: list[GraphNode]) -> str:
    """Return the tables of parameters, one for each node, in Markdown."""
    sections = []
    for node in nodes:
        head = f'\n## {node.get_name()}\n\n| parameter | default | range | what it is |\n'
        rows = []
        for name in parameter_names(node):
            if name.startswith(OF_EVERY_NODE) or name.startswith('qos_overrides'):
                continue
            descriptor = node.describe_parameter(name)
            shown = _default(node, name)
            text = descriptor.description
            if descriptor.read_only:
                text = f'{text.removesuffix(READ_ONLY)} (*fixed*)'
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


def _old_name(new: str | None) -> str:
    return '' if new is None else f' (old name of `{new.lstrip("/")}`)'


def _qos(profile: QoSProfile) -> str:
    text = f'{profile.reliability.name.lower().replace("_", " ")}, depth {profile.depth}'
    return text + (', latched' if 'LOCAL' in profile.durability.name else '')


def _default(node: GraphNode, name: str) -> str:
    if name in _SHOWN_FOR_PLACEHOLDER:
        return _SHOWN_FOR_PLACEHOLDER[name]
    value = node.get_parameter(name).value
    return repr(round(value, 6)) if isinstance(value, float) else repr(value)


def _range(descriptor: ParameterDescriptor) -> str:
    for bounds in (*descriptor.floating_point_range, *descriptor.integer_range):
        low, high = bounds.from_value, bounds.to_value
        if high >= UNBOUNDED:
            return f'from {low:g}'
        return f'up to {high:g}' if low <= -UNBOUNDED else f'{low:g} to {high:g}'
    return ''
