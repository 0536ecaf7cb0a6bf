"""A graph as data, and its command lines."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from rclpy.context import Context
from rclpy.node import Node

from ja_caregiver.core.schedule import Schedule, ScheduledLook, save_schedule
from ja_common.core.config import ConfigError
from ja_common.ros_arguments import split_ros_arguments
from ja_runner.graph import (
    CONFIG,
    MEMORY_PARAMETERS,
    film_graph,
    meet_graph,
    part_of_graph,
    preset,
    replace_nodes,
    rig_graph,
    sim_graph,
    with_arguments,
)
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


GRAPHS = {
    'sim': sim_graph(seed=3),
    'rig': rig_graph('clip.mp4'),
    'bare rig': rig_graph(),
    'meet': meet_graph('0'),
}


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


@pytest.fixture
def film(tmp_path):
    """Write a film of a second and its schedule; return the parameters that name them."""
    film, plan = tmp_path / 'film.avi', tmp_path / 'plan.csv'
    writer = cv2.VideoWriter(str(film), cv2.VideoWriter.fourcc(*'MJPG'), 10.0, (160, 90))
    for level in range(10):
        writer.write(np.full((90, 160, 3), 20 * level, np.uint8))
    writer.release()
    look = ScheduledLook(0.1, 0.3, 0.6, 1, ((0.3, 0.5), (0.7, 0.5)))
    save_schedule(Schedule((look,)), plan)
    return {'film': str(film), 'schedule': str(plan)}


@pytest.mark.parametrize('path', sorted(CONFIG.glob('*.yaml')), ids=lambda path: path.name)
def test_every_configured_parameter_exists_in_the_node_it_is_for(path, ros_context, film):
    graphs = [*GRAPHS.values(), film_graph(film)]
    graph = {spec.executable: spec for graph in graphs for spec in graph}
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


def parameters(graph):
    return {spec.executable: dict(spec.parameters) for spec in graph}


def test_a_meeting_is_a_rig_that_waits_for_her_and_starts_from_initial_weights():
    rig, meet = parameters(rig_graph(seed=3)), parameters(meet_graph(seed=3))
    scorer = meet.pop('request_scorer')
    assert scorer['seed'] == 3
    waits = meet['gate'].pop('dwell_s')
    assert waits >= scorer['answer_s'] + scorer['camera_s'] + 2 * scorer['least_look_s']
    for kept in rig.values():
        for name in MEMORY_PARAMETERS:
            kept.pop(name, None)
    assert meet == rig


def test_only_a_digital_head_waits_longer_for_late_pictures():
    rig, gates = rig_graph(), [parameters(meet_graph(source))['gate'] for source in (None, '0')]
    kept = parameters(rig)['gate']['hold_after_s']
    assert [gate['hold_after_s'] for gate in gates] == [kept, 1.0]


@pytest.mark.parametrize('pace', [0.25, 0.5, 2.0, 4.0])
def test_the_pace_of_a_meeting_scales_the_gate_and_the_scorer_alike(pace):
    usual, found = parameters(meet_graph()), parameters(meet_graph(pace=pace))
    for node, name in (
        ('gate', 'dwell_s'),
        ('request_scorer', 'camera_s'),
        ('request_scorer', 'answer_s'),
        ('request_scorer', 'least_look_s'),
    ):
        assert found[node][name] == pytest.approx(usual[node][name] / pace)
        assert found[node].pop(name)
        usual[node].pop(name)
    assert found == usual


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


@pytest.mark.parametrize(
    'options', [{'only': 'learning_module'}, {'without': ' gate, sim,scorer'}, {}]
)
def test_a_graph_is_split_over_two_machines(options):
    graph = sim_graph()
    here, elsewhere = part_of_graph(graph, **options)
    names = [spec.executable for spec in here]
    if 'only' in options:
        assert names == ['learning_module']
    else:
        assert ('gate' in names) is ('without' not in options)
    assert [spec for spec in graph if spec in here or spec in elsewhere] == graph
    assert not set(names) & {spec.executable for spec in elsewhere}


@pytest.mark.parametrize(
    ('options', 'sentence'),
    [
        ({'only': 'learner'}, 'no node learner in this graph; there are salient_feature_detector'),
        ({'without': 'gate,a,b'}, 'no node a, b in this graph'),
        ({'only': 'gate', 'without': 'sim'}, 'exclude each other'),
        ({'without': ','.join(spec.executable for spec in sim_graph())}, 'no node is left'),
    ],
)
def test_a_part_that_cannot_be_is_refused(options, sentence):
    with pytest.raises(ConfigError, match=sentence):
        part_of_graph(sim_graph(), **options)
