"""A graph refuses a parameter file that is for none of its nodes, and names what is for none."""

import pytest

from ja_common.core.config import ConfigError
from ja_runner.graph import rig_graph, with_arguments
from ja_runner.parameter_files import check_parameter_files
from ja_runner.running_nodes import full_names

NODES = ['/gate', '/learning_module', '/salient_feature_detector']


@pytest.fixture
def file(tmp_path):
    """Return a writer of a parameter file with these sections; it returns the arguments."""

    def write(*sections, names='enabled_at_start: false'):
        path = tmp_path / 'rig.yaml'
        path.write_text(''.join(f'{s}: {{ros__parameters: {{{names}}}}}\n' for s in sections))
        return ['--params-file', str(path)]

    return write


@pytest.mark.parametrize('section', ['/**/gaet', 'Gate', '/left/gate', '/robot/**', 'gate_node'])
def test_a_file_for_none_of_the_nodes_is_refused(file, section):
    with pytest.raises(ConfigError) as refused:
        check_parameter_files(NODES, file(section))
    for part in ('rig.yaml', section, '/gate, /learning_module', '/**/NAME'):
        assert part in str(refused.value)


def test_a_parameter_of_the_command_line_for_none_of_the_nodes_is_refused():
    assert check_parameter_files(NODES, ['-p', 'gate:max_speed_rad_s:=0.3']) == []
    with pytest.raises(ConfigError, match=r'-p gaet:max_speed_rad_s:=0\.3 is for none'):
        check_parameter_files(NODES, ['-p', 'gaet:max_speed_rad_s:=0.3'])
    with pytest.raises(ConfigError, match='is for none'):
        check_parameter_files(['/left/gate'], ['-p', 'gate:max_speed_rad_s:=0.3'])


def test_what_is_for_none_of_the_nodes_beside_what_is_for_some_is_named(file):
    arguments = file('/**/gate', '/learning_modul', 'my_driver', '/left/gate')
    path = arguments[1]
    assert check_parameter_files(NODES, arguments) == [
        f'section /learning_modul of {path} is for no node of this graph: '
        'is learning_module meant?',
        f'section /my_driver of {path} is for no node of this graph',
        f'section /left/gate of {path} is for no node of this graph: is /gate meant?',
    ]


def test_a_parameter_of_nodes_outside_of_the_graph_is_named(file):
    (sentence,) = check_parameter_files(NODES, file('/**', names='camera_rate_hz: 3.0'))
    assert 'no node of this graph has camera_rate_hz, only sim' in sentence
    (sentence,) = check_parameter_files(NODES, ['-p', 'max_sped_rad_s:=0.3'])
    assert sentence.endswith('no node has a parameter max_sped_rad_s: is max_speed_rad_s meant?')
    others = [*NODES, '/my_gate']  # whose parameters are not known
    assert check_parameter_files(others, file('/**', names='camera_rate_hz: 3.0')) == []


@pytest.mark.usefixtures('domain')
def test_the_names_of_a_graph_are_those_after_its_remaps():
    graph = with_arguments(rig_graph(), ['-r', '__ns:=/left', '-r', 'gate:__node:=guard'])
    names = full_names(graph)
    assert {'/left/guard', '/left/learning_module'} <= set(names)
