"""A graph as data: which nodes, with which parameters and remappings."""

import importlib
import importlib.util
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

from ja_common.core.config import ConfigError
from ja_common.ros_arguments import parameter_arguments

CONFIG = Path(str(files('ja_runner'))) / 'config'


@dataclass(frozen=True)
class NodeSpec:
    """One node, as its own process or as one of many in a process.

    `thing` is the file's name without `_node`, the executable's and, unless remapped, the node's.
    `arguments` are further ROS arguments, the user's (`-r`, `-p`, `--params-file`); they stand
    last, so that they win. `environ` is added to the process's environment.
    """

    package: str
    thing: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    remappings: Mapping[str, str] = field(default_factory=dict)
    arguments: Sequence[str] = ()
    environ: Mapping[str, str] = field(default_factory=dict)

    @property
    def module(self) -> str:
        return f'{self.package}.{self.thing}_node'

    @property
    def class_name(self) -> str:
        return ''.join(word.capitalize() for word in self.thing.split('_')) + 'Node'

    def ros_arguments(self) -> list[str]:
        """The node's arguments, from `--ros-args` on."""
        arguments = ['--ros-args', *parameter_arguments(self.parameters)]
        for old, new in self.remappings.items():
            arguments += ['-r', f'{old}:={new}']
        return [*arguments, *self.arguments]

    def command(self) -> list[str]:
        """The command line of the node's own process; it ends with the process that starts it."""
        return [sys.executable, '-m', 'ja_runner.child', self.module, *self.ros_arguments()]

    def load(self) -> type:
        """The node's class, for the composition in one process."""
        return getattr(importlib.import_module(self.module), self.class_name)


RECORDER = NodeSpec('ja_recording', 'recorder')
"""Stands first in a graph that is recorded, so that it misses nothing."""


def with_arguments(graph: Sequence[NodeSpec], arguments: Sequence[str]) -> list[NodeSpec]:
    """The graph with further ROS arguments for every node."""
    return [replace(node, arguments=[*node.arguments, *arguments]) for node in graph]


def swapped(graph: Sequence[NodeSpec], swaps: Sequence[str]) -> list[NodeSpec]:
    """The graph with nodes of other packages in the place of ours: `gate=my_lab/my_gate`.

    The other node (`my_lab/my_gate_node.py`, class `MyGateNode`) gets the same parameters and
    remappings. Raises ConfigError for a node that is not there.
    """
    others: dict[str, tuple[str, str]] = {}
    for swap in swaps:
        ours, _, theirs = swap.partition('=')
        package, _, thing = theirs.partition('/')
        if ours not in {node.thing for node in graph}:
            there = ', '.join(node.thing for node in graph)
            raise ConfigError(f'{swap}: no node {ours!r} in this graph; there are {there}')
        if not (package and thing and _is_there(f'{package}.{thing}_node')):
            raise ConfigError(
                f'{swap}: behind = belongs PACKAGE/THING, with a file PACKAGE/THING_node.py that '
                'Python finds (PYTHONPATH)'
            )
        others[ours] = package, thing
    return [
        replace(node, package=others[node.thing][0], thing=others[node.thing][1])
        if node.thing in others
        else node
        for node in graph
    ]


def _is_there(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:  # the package itself
        return False


def preset(path: Path, thing: str) -> dict[str, Any]:
    """What a ROS parameter file says to one node: the section of all, then the node's own.

    Read here and handed over with `-p`: rcl prefers a file's section for one node to any `-p`, so
    that a user's `-p` would not win over ours.
    """
    sections = yaml.safe_load(path.read_text())
    parameters: dict[str, Any] = {}
    for section in ('/**', f'/**/{thing}'):
        parameters |= sections.get(section, {}).get('ros__parameters', {})
    return parameters


def sim_graph(
    seed: int = 0, sim_parameters: Mapping[str, Any] | None = None, learner: str = 'gaze_line'
) -> list[NodeSpec]:
    """The mind before the simulated head. The seed is everybody's, so that a run repeats.

    `learner`: whose preset (`config/demo_<learner>.yaml`) says how the learner and the gate are
    set: the fast one, or the paper's. If the sim draws ahead, each glance of the fast one lasts
    for two images, and only a third is a fixation.
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
    """The mind before a real picture.

    With a source (webcam, video file, image folder) a digital pan-tilt head moves its window in
    that picture. Without one, the rig's own drivers publish `image_raw` and `joint_states`, and
    obey `joint_commands`.
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
    """What looks, learns and moves, whatever the head and the camera are."""
    return [
        NodeSpec('ja_perception', 'salient_feature_detector'),
        NodeSpec('ja_control', 'visual_feedback_controller'),
        NodeSpec('ja_learning', 'internal_evaluator'),
        NodeSpec('ja_learning', 'learning_module', {'seed': seed}),
        NodeSpec('ja_control', 'gate', {'seed': seed}),
    ]


def _configured(path: Path, graph: Sequence[NodeSpec]) -> list[NodeSpec]:
    """The graph with a preset below the parameters that it has already."""
    return [
        replace(node, parameters={**preset(path, node.thing), **node.parameters}) for node in graph
    ]
