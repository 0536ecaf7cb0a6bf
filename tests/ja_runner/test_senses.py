"""`--senses`: the parameters of each node that has a part in a sense."""

import pytest
from typer.testing import CliRunner

from ja_bringup.cli import app
from ja_common.core.config import ConfigError
from ja_common.core.parameter_page import project_parameters
from ja_runner.graph import rig_graph, sim_graph
from ja_runner.senses import SENSES, parse_senses, with_senses


def parameters(graph, senses):
    return {spec.executable: spec.parameters for spec in with_senses(graph, senses)}


def test_without_senses_a_graph_is_as_it_was():
    assert with_senses(sim_graph(), parse_senses('')) == sim_graph()


@pytest.mark.parametrize('text', ['eyes,depth', ' depth , eyes'])
def test_both_senses_reach_the_sim_the_detector_and_the_learner(text):
    found = parameters(sim_graph(), parse_senses(text))
    assert found['sim']['depth'] == 'sensor'
    assert found['salient_feature_detector']['read_gaze'] is True
    learner = found['learning_module']
    assert (learner['face_reader'], learner['use_ranges']) == ('landmarks', True)


def test_depth_alone_leaves_the_reader_of_faces():
    found = parameters(sim_graph(), ['depth'])
    assert 'read_gaze' not in found['salient_feature_detector']
    assert 'face_reader' not in found['learning_module']


def test_a_rig_has_its_own_sensor():
    assert parameters(rig_graph(), ['depth'])['learning_module']['use_ranges'] is True


def test_a_rig_keeps_what_it_learns_with_other_senses_in_another_folder():
    bare, found = (parameters(rig_graph(), senses) for senses in ([], ['depth', 'eyes']))
    assert bare['learning_module']['checkpoint_folder'] == 'runs/rig/checkpoints'
    assert found['learning_module']['checkpoint_folder'] == 'runs/rig-eyes-depth/checkpoints'
    assert found['gate']['trials_file'] == 'runs/rig-eyes-depth/trials'


@pytest.mark.parametrize('sense', SENSES)
def test_each_node_has_the_parameters_that_a_sense_sets(sense):
    known = project_parameters()
    for node, values in SENSES[sense].items():
        assert values.keys() <= set(known[node]), node


@pytest.mark.parametrize(
    ('text', 'sentence'),
    [
        ('nose', "'nose' is no sense: choose some of eyes, depth, second-camera"),
        ('eyes;depth', "'eyes;depth' is no sense"),
        ('depth,second-camera', 'both measure ranges'),
    ],
)
def test_nonsense_gets_one_sentence(text, sentence):
    with pytest.raises(ConfigError, match=sentence):
        parse_senses(text)


@pytest.mark.parametrize('command', ['demo', 'rig'])
def test_the_commands_refuse_nonsense_before_anything_starts(command):
    found = CliRunner().invoke(app, [command, '--senses', 'nose'])
    assert isinstance(found.exception, ConfigError)
    assert 'is no sense' in str(found.exception)


def test_the_papers_network_uses_no_senses():
    with pytest.raises(ConfigError, match='reads the picture of her face alone'):
        with_senses(sim_graph(learner='paper'), ['eyes'])
    assert with_senses(sim_graph(learner='paper'), []) == sim_graph(learner='paper')
