"""A graph as data, and its command lines."""

from pathlib import Path

import pytest
import yaml
from rclpy.context import Context
from rclpy.node import Node

from ja_common.core.config import ConfigError
from ja_common.ros_arguments import split_ros_arguments
from ja_runner.graph import CONFIG, preset, replace_nodes, rig_graph, sim_graph, with_arguments
from ja_runner.node_spec import NodeSpec


def test_names_follow_from_the_executable():
    spec = NodeSpec('ja_control', 'visual_feedback_controller')
    assert spec.module == 'ja_control.visual_feedback_controller_node'
    assert spec.class_name == 'VisualFeedbackControllerNode'


@pytest.mark.parametrize('value', [True, 3, 2.5, 1e-7, 'word', '12', '', 'a: b', [1.0, 2.0]])
def test_parameters_arrive_unchanged(value, ros_context):
    spec = NodeSpec('p', 't', parameters={'value': value})
    node = Node('t', context=ros_context, cli_args=spec.ros_arguments())
    received = node.declare_parameter('value', value).value
    node.destroy_node()
    assert (list(received) if isinstance(value, list) else received) == value


def test_the_user_wins_over_the_preset(ros_context: Context, tmp_path: Path):
    """By a file for all, by a file for one node, and by -p."""
    ours = tmp_path / 'preset.yaml'
    ours.write_text(
        '/**:\n  ros__parameters: {a: 1, b: 1, c: 1, d: 1}\n'
        '/**/t:\n  ros__parameters: {b: 2, c: 2, d: 2, e: 2}\n'
        '/**/other:\n  ros__parameters: {a: 9}\n'
    )
    theirs = tmp_path / 'mine.yaml'
    theirs.write_text('/**:\n  ros__parameters: {b: 3}\n/**/t:\n  ros__parameters: {c: 3}\n')
    spec = NodeSpec('p', 't', preset(ours, 't'), {'chatter': 'talk'})
    user = ['--params-file', str(theirs), '-p', 'd:=3', '-r', '__ns:=/robot']
    [spec] = with_arguments([spec], user)
    node = Node('t', context=ros_context, cli_args=spec.ros_arguments())
    values = {name: node.declare_parameter(name, 0).value for name in 'abcde'}
    namespace, topic = node.get_namespace(), node.resolve_topic_name('chatter')
    node.destroy_node()
    assert values == {'a': 1, 'b': 3, 'c': 3, 'd': 3, 'e': 2}
    assert (namespace, topic) == ('/robot', '/robot/talk')


@pytest.mark.parametrize(
    ('argv', 'ours', 'ros'),
    [
        ([], [], []),
        (['demo', '--trials', '3'], ['demo', '--trials', '3'], []),
        (['demo', '--ros-args', '-r', 'a:=b'], ['demo'], ['-r', 'a:=b']),
        (['demo', '--ros-args', '-r', 'a:=b', '--', '--seed', '1'],
         ['demo', '--seed', '1'], ['-r', 'a:=b']),
    ],
)  # fmt: skip
def test_ros_arguments_are_split_off(argv, ours, ros):
    assert split_ros_arguments(argv) == (ours, ros)


GRAPHS = {'sim': sim_graph(seed=3), 'rig': rig_graph('clip.mp4'), 'bare rig': rig_graph()}


@pytest.mark.parametrize('graph', GRAPHS.values(), ids=GRAPHS.keys())
def test_every_node_of_a_graph_is_there(graph):
    for spec in graph:
        assert issubclass(spec.load(), Node)


@pytest.mark.parametrize(('ahead', 'glance_images'), [(False, 1), (True, 2)])
def test_a_fixation_is_longer_than_a_glance_of_the_fast_learner(ahead, glance_images):
    graph = {n.executable: n.parameters for n in sim_graph(sim_parameters={'draw_ahead': ahead})}
    image_s = 1 / graph['sim']['camera_rate_hz']
    hold_s = graph['internal_evaluator']['hold_s']
    # From the first image at rest to the last one of a glance, and to the next after that.
    assert (glance_images - 1) * image_s < hold_s < glance_images * image_s
    assert graph['gate']['fixation_wait_s'] == hold_s


def test_only_the_sim_graph_has_a_truth_to_score():
    assert {'sim', 'scorer'} <= {spec.executable for spec in GRAPHS['sim']}
    for name in ('rig', 'bare rig'):
        assert not {'sim', 'scorer'} & {spec.executable for spec in GRAPHS[name]}
    assert 'camera' not in {spec.executable for spec in GRAPHS['bare rig']}


@pytest.mark.parametrize('path', sorted(CONFIG.glob('*.yaml')), ids=lambda path: path.name)
def test_every_configured_parameter_exists_in_the_node_it_is_for(path, ros_context):
    graph = {spec.executable: spec for graph in GRAPHS.values() for spec in graph}
    sections = yaml.safe_load(path.read_text())
    for section, content in sections.items():
        executable = section.rsplit('/', 1)[-1]
        if executable == '**':
            continue
        spec = graph[executable]
        node = spec.load()(context=ros_context, cli_args=spec.ros_arguments())
        unknown = [name for name in content['ros__parameters'] if not node.has_parameter(name)]
        node.destroy_node()
        assert not unknown, f'{path.name}, {section}: no such parameter'


@pytest.mark.parametrize('name', ['rig_ros2_control', 'rig_topics'])
def test_configurations_of_rigs_fit_the_gate(name, ros_context):
    """A name or value that the gate does not know would be an error here, not on the rig."""
    [gate] = [spec for spec in rig_graph() if spec.executable == 'gate']
    parameters = {**gate.parameters, **preset(CONFIG / f'{name}.yaml', 'gate')}
    spec = NodeSpec('ja_control', 'gate', parameters)
    node = spec.load()(context=ros_context, cli_args=spec.ros_arguments())
    declared = {each: node.get_parameter(each).value for each in parameters}
    node.destroy_node()
    assert declared == parameters


def test_on_a_rig_learner_and_gate_keep_what_they_know_side_by_side():
    kept = {spec.executable: spec.parameters for spec in GRAPHS['bare rig']}
    checkpoints = Path(kept['learning_module']['checkpoint_folder'])
    assert Path(kept['gate']['trials_file']).parent == checkpoints.parent


def test_a_node_of_another_package_takes_the_place_and_the_parameters():
    ours = sim_graph(seed=3)
    theirs = replace_nodes(ours, ['gate=ja_sim/scorer'])
    changed = [(a, b) for a, b in zip(ours, theirs, strict=True) if a != b]
    [(gate, other)] = changed
    assert (other.package, other.executable) == ('ja_sim', 'scorer')
    assert other.parameters == gate.parameters


@pytest.mark.parametrize(
    ('swap', 'why'),
    [
        ('gat=ja_sim/scorer', "no node 'gat'"),
        ('gate', 'PACKAGE/EXECUTABLE'),
        ('gate=scorer', 'PACKAGE/EXECUTABLE'),
        ('gate=ja_sim/missing', 'PYTHONPATH'),
        ('gate=nowhere/scorer', 'PYTHONPATH'),
    ],
)
def test_an_impossible_replacement_is_refused_with_the_reason(swap, why):
    with pytest.raises(ConfigError, match=why):
        replace_nodes(sim_graph(), [swap])
