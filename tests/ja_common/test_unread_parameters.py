"""A parameter that reaches no node is found, and the nearest name with it."""

import pytest

from ja_common.core.parameter_page import parameter_page, project_parameters
from ja_common.core.parameter_sections import ParameterSection
from ja_common.core.unread_parameters import unread_parameters

GATE = ('enabled_at_start', 'max_speed_rad_s', 'pan_joint', 'use_sim_time')
PROJECT = {
    'gate': GATE,
    'sim': ('camera_rate_hz', 'pan_joint', 'use_sim_time'),
    'eye': ('rate_hz', 'pan_joint', 'use_sim_time'),
}


def section(nodes, *names):
    return ParameterSection('rig.yaml', nodes, names)


def unread(*sections, node='/gate', more=()):
    """Return what a node of these sections reports; rcl gives it those that are for it."""
    declared = PROJECT[node.rpartition('/')[2]]
    given = {name for each in sections if each.is_for(node) for name in each.names} | set(more)
    return [each.sentence for each in unread_parameters(node, declared, given, sections, PROJECT)]


def test_what_is_declared_and_what_is_for_others_is_no_matter():
    assert unread(
        section('/**/gate', 'enabled_at_start', 'max_speed_rad_s'),
        section('/**', 'camera_rate_hz', 'pan_joint', 'use_sim_time'),
        section('/**/sim', 'nonsense'),
        section('my_driver', 'port', 'speed'),
    ) == []  # fmt: skip


@pytest.mark.parametrize('nodes', ['/gate', '/**/gate'])
def test_a_misspelt_name_in_the_nodes_own_section(nodes):
    assert unread(section(nodes, 'enabled_at_strat', 'wheel_base')) == [
        f'/gate has no parameter enabled_at_strat (section {nodes} of rig.yaml): '
        'is enabled_at_start meant?',
        f'/gate has no parameter wheel_base (section {nodes} of rig.yaml)',
    ]


def test_a_parameter_of_another_node_in_the_nodes_own_section():
    (sentence,) = unread(section('/gate', 'camera_rate_hz'))
    assert sentence.startswith('/gate has no parameter camera_rate_hz')


def test_a_parameter_given_by_a_program_counts_as_the_nodes_own():
    assert unread(more=['max_speed']) == [
        '/gate has no parameter max_speed: is max_speed_rad_s meant?'
    ]


def test_a_misspelt_name_for_all_nodes_is_reported_by_the_one_that_has_the_nearest():
    shared = section('/**', 'max_sped_rad_s')
    assert unread(shared) == [
        'no node has a parameter max_sped_rad_s (section /** of rig.yaml): '
        'is max_speed_rad_s meant?'
    ]
    assert unread(shared, node='/sim') == []


def test_a_name_for_all_nodes_that_is_near_to_none_is_reported_by_all():
    shared = section('/**', 'wheel_base')
    for node in ('/gate', '/sim'):
        assert unread(shared, node=node) == [
            'no node has a parameter wheel_base (section /** of rig.yaml)'
        ]


@pytest.mark.parametrize('nodes', ['/gaet', '/left/gate', '/**/head_gate', '/gate_node'])
def test_a_section_for_another_name_with_parameters_of_this_node_alone(nodes):
    meant = section(nodes, 'enabled_at_start', 'max_speed_rad_s')
    (sentence,) = unread(meant)
    assert sentence.startswith(f'section {nodes} of rig.yaml is not for this node')
    assert unread(meant, node='/sim') == []
    assert unread(meant, section('/**/gate', 'pan_joint')) == [], 'its own section came, too'


def test_a_section_of_another_node_with_names_in_common_is_foreign():
    assert unread(section('/other', 'pan_joint', 'use_sim_time')) == []
    assert unread(section('/other', 'max_speed_rad_s', 'wheel_base', 'port')) == []
    assert unread(section('/sim', 'max_speed_rad_s')) == [], 'the sim reports it'


def test_the_page_of_parameters_can_be_read():
    rows = {row.name: row for row in parameter_page()['gate']}
    assert rows['enabled_at_start'].default == 'True'
    assert rows['control_rate_hz'].range == '10 to 500'
    assert all(row.text for node in parameter_page().values() for row in node)
    names = project_parameters()
    assert {'gate', 'sim', 'camera', 'recorder', 'view'} <= names.keys()
    assert 'use_sim_time' in names['gate']
