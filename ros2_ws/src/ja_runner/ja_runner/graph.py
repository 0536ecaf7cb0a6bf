"""Which nodes make a graph, and their presets; a graph is a list of NodeSpec."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from ja_common.core.config import ConfigError
from ja_common.core.safe_files import load_yaml
from ja_runner.node_spec import NodeSpec
from ja_runner.parts import is_installed

CONFIG = Path(str(files('ja_runner'))) / 'config'


RECORDER = NodeSpec('ja_recording', 'recorder')
"""The first node of a graph that is recorded, so that it misses no message."""


def with_arguments(graph: Sequence[NodeSpec], arguments: Sequence[str]) -> list[NodeSpec]:
    """Return the graph with further ROS arguments for every node."""
    return [replace(node, arguments=[*node.arguments, *arguments]) for node in graph]


def replace_nodes(graph: Sequence[NodeSpec], replacements: Sequence[str]) -> list[NodeSpec]:
    """Replace nodes of a graph with nodes of other packages: `gate=my_lab/my_gate`.

    The other node (`my_lab/my_gate_node.py`, class `MyGateNode`) gets the same parameters and
    remappings. Raises ConfigError for a node that does not exist.
    """
    others: dict[str, tuple[str, str]] = {}
    for replacement in replacements:
        ours, _, theirs = replacement.partition('=')
        package, _, executable = theirs.partition('/')
        if ours not in {node.executable for node in graph}:
            known = ', '.join(node.executable for node in graph)
            raise ConfigError(f'{replacement}: no node {ours!r} in this graph; there are {known}')
        if not (package and executable and is_installed(f'{package}.{executable}_node')):
            raise ConfigError(
                f'{replacement}: write NODE=PACKAGE/EXECUTABLE, where Python finds a file '
                'PACKAGE/EXECUTABLE_node.py; PYTHONPATH=. before the command lets it search the '
                'current folder'
            )
        others[ours] = package, executable
    return [
        replace(
            node,
            package=others[node.executable][0],
            executable=others[node.executable][1],
            has_heartbeat=False,
        )
        if node.executable in others
        else node
        for node in graph
    ]


def preset(path: Path, executable: str) -> dict[str, Any]:
    """Read the parameters of one node from a ROS parameter file.

    They are those of the section `/**`, overridden by those of the node's own section. They are
    passed with `-p` and not as a file: rcl prefers a file's section for one node to any `-p`, so
    a `-p` of the user would not override our file.
    """
    sections = load_yaml(path)
    parameters: dict[str, Any] = {}
    for section in ('/**', f'/**/{executable}'):
        parameters |= sections.get(section, {}).get('ros__parameters', {})
    return parameters


def sim_graph(
    seed: int = 0, sim_parameters: Mapping[str, Any] | None = None, learner: str = 'gaze_line'
) -> list[NodeSpec]:
    """Return the attention nodes with the simulated head; all get the seed, so a run repeats.

    `learner` (`gaze_line` or `paper`) chooses the preset `config/demo_<learner>.yaml` of the
    learner and the gate. If the sim draws ahead, each glance of the `gaze_line` learner lasts for
    two images, and only a third image is a fixation.
    """
    sim = {'seed': seed, **(sim_parameters or {})}
    graph = [*_attention_nodes(seed), NodeSpec('ja_sim', 'scorer'), NodeSpec('ja_sim', 'sim', sim)]
    presets = [f'demo_{learner}.yaml', 'demo.yaml']
    if sim.get('draw_ahead') and learner == 'gaze_line':
        presets.insert(0, 'demo_gaze_line_ahead.yaml')
    for name in presets:
        graph = _configured(CONFIG / name, graph)
    return graph


def rig_graph(source: str | None = None, seed: int = 0) -> list[NodeSpec]:
    """Return the attention nodes with real pictures.

    With a source (webcam, video file, image folder) a digital pan-tilt head moves its window in
    that picture. Without one, the rig's own drivers publish `image_raw` and `joint_states`, and
    subscribe to `joint_commands`.
    """
    graph = _attention_nodes(seed)
    if source is not None:
        wide = {name: f'wide/{name}' for name in ('image_raw', 'camera_info')}
        graph += [
            NodeSpec('ja_sim', 'digital_head'),
            NodeSpec('ja_perception', 'camera', {'source': source}, wide),
        ]
    return _configured(CONFIG / 'rig.yaml', graph)


def _attention_nodes(seed: int) -> list[NodeSpec]:
    """Return the nodes that see, learn and move; the same for every head and camera."""
    return [
        NodeSpec('ja_perception', 'salient_feature_detector'),
        NodeSpec('ja_control', 'visual_feedback_controller'),
        NodeSpec('ja_learning', 'internal_evaluator'),
        NodeSpec('ja_learning', 'learning_module', {'seed': seed}),
        NodeSpec('ja_control', 'gate', {'seed': seed}),
    ]


def _configured(path: Path, graph: Sequence[NodeSpec]) -> list[NodeSpec]:
    """Return the graph with a preset's parameters added; those that it has already win."""
    return [
        replace(node, parameters={**preset(path, node.executable), **node.parameters})
        for node in graph
    ]
