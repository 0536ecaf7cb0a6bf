"""Which nodes make a graph, and their presets; a graph is a list of NodeSpec."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from ja_common.core.config import ConfigError
from ja_common.core.safe_files import load_yaml
from ja_common.head_description import WIDE_FRAME
from ja_runner.node_spec import NodeSpec
from ja_runner.parts import is_installed

CONFIG = Path(str(files('ja_runner'))) / 'config'


RECORDER = NodeSpec('ja_recording', 'recorder')
"""The first node of a graph that is recorded, so that it misses no message."""

MEMORY_PARAMETERS = ('checkpoint_folder', 'trials_file')
"""Where learner and gate keep what they know over a restart."""


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


def part_of_graph(
    graph: Sequence[NodeSpec], only: str = '', without: str = ''
) -> tuple[list[NodeSpec], list[NodeSpec]]:
    """Split a graph into the nodes that run here and those that run on another machine.

    `only` and `without` are names of nodes, separated by commas; at most one of them is not empty.
    Raises ConfigError for a name that the graph has not, and where no node is left.
    """
    if only and without:
        raise ConfigError('--only and --without exclude each other: give one of them')
    chosen = {name for name in map(str.strip, (only or without).split(',')) if name}
    known = [spec.executable for spec in graph]
    if unknown := sorted(chosen - set(known)):
        raise ConfigError(
            f'no node {", ".join(unknown)} in this graph; there are {", ".join(known)}'
        )
    here: list[NodeSpec] = []
    elsewhere: list[NodeSpec] = []
    for spec in graph:
        stays = spec.executable in chosen if only else spec.executable not in chosen
        (here if stays else elsewhere).append(spec)
    if not here:
        raise ConfigError(f'no node is left to run here; there are {", ".join(known)}')
    return here, elsewhere


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
    return _configured(CONFIG / 'rig.yaml', _rig_nodes(source, seed))


def meet_graph(
    source: str | None = None,
    seed: int = 0,
    pace: float = 1.0,
    scorer_parameters: Mapping[str, Any] | None = None,
) -> list[NodeSpec]:
    """Return the nodes of `rig_graph` and the scorer that asks a person to look at things.

    The robot's nodes are those of a rig, with a gate that leaves her the time to turn; none of
    them subscribes to what she is asked. `pace`: 2 is twice as fast. What is learned is saved
    where `run_graph` puts it, not where a rig keeps it: each meeting starts from initial weights.
    """
    scorer = NodeSpec(
        'ja_caregiver', 'request_scorer', {'seed': seed, **(scorer_parameters or {})}
    )
    graph = [*_rig_nodes(source, seed), scorer]
    if source is not None:
        graph = _configured(CONFIG / 'meet_digital_head.yaml', graph)
    graph = [_at_pace(spec, pace) for spec in _configured(CONFIG / 'meet.yaml', graph)]
    return [_without_memory(spec) for spec in _configured(CONFIG / 'rig.yaml', graph)]


def film_graph(film_parameters: Mapping[str, Any], seed: int = 0) -> list[NodeSpec]:
    """Return the attention nodes and the player of a film with a schedule, in lockstep.

    `film_parameters`: those of the node `film_session`, which is camera, digital head and scorer.
    The gate looks at her for as long as each look is shown.
    """
    film = NodeSpec('ja_caregiver', 'film_session', {'seed': seed, **film_parameters})
    graph = [*_attention_nodes(seed), film]
    for name in ('meet_film.yaml', 'demo_gaze_line.yaml', 'demo.yaml'):
        graph = _configured(CONFIG / name, graph)
    return graph


_PACED = ('dwell_s', 'camera_s', 'least_look_s', 'answer_s')
"""The times of `meet.yaml` that grow shorter with a faster pace."""


def _at_pace(spec: NodeSpec, pace: float) -> NodeSpec:
    paced = {name: spec.parameters[name] / pace for name in _PACED if name in spec.parameters}
    return replace(spec, parameters={**spec.parameters, **paced})


def _without_memory(spec: NodeSpec) -> NodeSpec:
    """Return the node without the places in which a rig keeps what it learned."""
    kept = {k: v for k, v in spec.parameters.items() if k not in MEMORY_PARAMETERS}
    return replace(spec, parameters=kept)


def _rig_nodes(source: str | None, seed: int) -> list[NodeSpec]:
    """Return the attention nodes and, with a source, the digital head and its camera."""
    graph = _attention_nodes(seed)
    if source is not None:
        wide = {name: f'wide/{name}' for name in ('image_raw', 'camera_info')}
        graph += [
            NodeSpec('ja_sim', 'digital_head'),
            NodeSpec('ja_perception', 'camera', {'source': source, 'frame_id': WIDE_FRAME}, wide),
        ]
    return graph


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
