"""Sections of parameter files and `-p`: for the nodes that rcl gives them to, and no others."""

import pytest
from rclpy.node import Node

from ja_common.core.config import ConfigError
from ja_common.core.parameter_sections import ParameterSection, parameter_sections
from ja_common.private_context import private_context
from ja_common.rclpy_private import parameter_overrides

PATTERNS = [
    '/**', '/*', '**', '*', 'gate', '/gate', '/**/gate', '**/gate', '/*/gate', '/left/gate',
    'left/gate', '/left/**', '/left/*', '/lef/gate', '/left/gat', '/**/left/gate',
    '/left/**/gate', '/*/*', '/**/*', 'eft/gate', '/a/**', '/gaet',
]  # fmt: skip


@pytest.mark.usefixtures('domain')
def test_a_section_is_for_the_nodes_to_which_rcl_gives_it(tmp_path):
    path = tmp_path / 'parameters.yaml'
    names = [f'x{number}' for number in range(len(PATTERNS))]
    for namespace in ('/', '/left', '/a/left'):
        got = set()
        for pattern, name in zip(PATTERNS, names, strict=True):
            path.write_text(f'"{pattern}": {{ros__parameters: {{{name}: 1}}}}')
            arguments = ['--params-file', str(path)]
            with private_context(arguments, discovery=False) as context:
                node = Node('gate', namespace=namespace, context=context, enable_rosout=False)
                full_name = node.get_fully_qualified_name()
                (section,) = parameter_sections(arguments)
                assert section.is_for(full_name) is (name in parameter_overrides(node)), pattern
                got |= set(parameter_overrides(node)) & set(names)
                node.destroy_node()
        assert got, 'some patterns match'


def test_namespaces_and_names_may_be_nested(tmp_path):
    path = tmp_path / 'parameters.yaml'
    path.write_text(
        'left:\n  gate:\n    ros__parameters:\n      a: {b: 1, c: [2]}\n      d: x\n'
        '  /eye:\n    ros__parameters:\n/**:\n  ros__parameters: {e: 1}\n'
    )
    assert parameter_sections(['-r', 'a:=b', '--params-file', str(path)]) == [
        ParameterSection(str(path), '/left/gate', ('a.b', 'a.c', 'd')),
        ParameterSection(str(path), '/left/eye', ()),
        ParameterSection(str(path), '/**', ('e',)),
    ]


def test_parameters_of_the_command_line_are_for_any_node_or_for_one():
    shared, own = parameter_sections(['-p', 'source:=http://here:80/a', '--param', 'gate:x:=1'])
    assert (shared.nodes, shared.names, shared.is_shared) == ('/**', ('source',), True)
    assert (own.nodes, own.names, own.is_shared) == ('/gate', ('x',), False)
    assert str(own) == '--param gate:x:=1'


def test_a_value_outside_of_a_section_is_one_sentence(tmp_path):
    path = tmp_path / 'parameters.yaml'
    path.write_text('gate:\n  max_speed_rad_s: 0.3\n')
    with pytest.raises(ConfigError, match='gate/max_speed_rad_s stands outside of a section'):
        parameter_sections(['--params-file', str(path)])
