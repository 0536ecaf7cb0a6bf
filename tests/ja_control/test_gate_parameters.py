"""The gate does not start with a parameter that reaches nothing: it may hold a safe value."""

import pytest
from rclpy.parameter import Parameter

from ja_common.core.config import ConfigError
from ja_control.gate_node import GateNode, main


@pytest.mark.parametrize(
    ('text', 'sentence'),
    [
        ('/**/gate: {ros__parameters: {enabled_at_strat: false}}', 'is enabled_at_start meant?'),
        ('/**/gate: {ros__parameters: {max_speed: 0.3}}', 'is max_speed_rad_s meant?'),
        ('/**/gate: {ros__parameters: {wheel_base: 0.3}}', 'has no parameter wheel_base'),
        ('/**: {ros__parameters: {pan_max_rads: 0.3}}', 'is pan_max_rad meant?'),
        ('/**/gaet: {ros__parameters: {enabled_at_start: false}}', 'its name is /gate'),
        ('/left/gate: {ros__parameters: {enabled_at_start: false}}', 'its name is /gate'),
    ],
)
def test_it_ends_the_start_with_one_sentence(domain, tmp_path, capfd, text, sentence):
    path = tmp_path / 'rig.yaml'
    path.write_text(text)
    with pytest.raises(SystemExit) as ended:
        main(['--ros-args', '--params-file', str(path)])
    assert ended.value.code == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith('error: ')
    assert sentence in line
    assert str(path) in line


@pytest.mark.usefixtures('domain')
def test_a_name_on_the_command_line_may_be_for_this_node_alone(capfd):
    with pytest.raises(SystemExit):
        main(['--ros-args', '-p', 'gate:hold_after:=0.3'])
    assert 'is hold_after_s meant?' in capfd.readouterr().err


def test_parameters_of_other_nodes_are_none_of_its_business(ros_context, capfd):
    arguments = ['-p', 'camera_rate_hz:=3.0', '-p', 'wheel_base:=1', '-p', 'sim:nonsense:=1']
    gate = GateNode(context=ros_context, cli_args=['--ros-args', *arguments])
    gate.check_parameters(arguments)
    assert gate.health.report(0.0).message == 'OK'
    assert 'no node has a parameter wheel_base' in capfd.readouterr().err
    given = [Parameter('nonsense', value=1)]
    other = GateNode(context=ros_context, parameter_overrides=given)
    with pytest.raises(ConfigError, match='/gate has no parameter nonsense'):
        other.check_parameters([])
    for node in (gate, other):
        node.destroy_node()


@pytest.mark.parametrize('option', ['--help', '-h'])
def test_main_shows_its_usage_and_makes_no_node(capfd, option):
    main(['--ros-args', '-p', 'seed:=0', '--', option])
    shown = capfd.readouterr().out
    assert shown.startswith('usage: gate [--ros-args')
    assert 'only it commands the head' in shown
    assert '  control_rate_hz (200.0; 10 to 500)\n' in shown
    assert '(fixed)' in shown
    assert len(shown.splitlines()) > 40


def test_main_refuses_what_is_neither_an_option_nor_a_ros_argument(capfd):
    with pytest.raises(SystemExit) as ended:
        main(['max_speed_rad_s:=3', '--ros-args', '-p', 'seed:=0'])
    assert ended.value.code == 2
    error = capfd.readouterr().err
    assert error == 'error: unknown: max_speed_rad_s:=3; parameters: --ros-args -p NAME:=VALUE\n'
