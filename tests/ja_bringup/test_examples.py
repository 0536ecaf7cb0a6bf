"""Every command shows examples in its --help, and each of them is a line that it understands."""

import shlex

import pytest
import typer
from typer.testing import CliRunner

from ja_bringup.cli import app
from ja_bringup.examples import EXAMPLES
from ja_common.ros_arguments import check_ros_arguments, split_ros_arguments

COMMANDS = typer.main.get_command(app).commands  # type: ignore[attr-defined]
LINES = [(name, line) for name in COMMANDS for line in EXAMPLES.get(name, {})]


@pytest.mark.parametrize('name', COMMANDS)
def test_help_shows_what_the_command_does_and_examples(name: str) -> None:
    shown = CliRunner(env={'COLUMNS': '200'}).invoke(app, [name, '--help']).output
    assert COMMANDS[name].help.split('\n')[0][:60] in shown
    assert EXAMPLES.get(name), f'ja_bringup/examples.py has none for {name}'
    for line, purpose in EXAMPLES[name].items():
        assert f'{line}   # {purpose}' in shown


def test_there_are_no_examples_of_removed_commands() -> None:
    assert EXAMPLES.keys() <= COMMANDS.keys()


@pytest.mark.parametrize(('name', 'line'), LINES, ids=[line for _, line in LINES])
def test_an_example_is_a_line_that_its_command_understands(name: str, line: str) -> None:
    words = shlex.split(line.split(' | ')[0])
    start = words.index('./ja')
    assert all('=' in setting for setting in words[:start])
    ours, ros = split_ros_arguments(words[start + 1 :])
    assert ours[0] == name
    COMMANDS[name].make_context(name, ours[1:])  # raises UsageError
    check_ros_arguments(ros)


def test_an_option_that_does_not_exist_is_noticed() -> None:
    with pytest.raises(Exception, match='No such option'):
        COMMANDS['demo'].make_context('demo', ['--lerner', 'paper'])


@pytest.mark.parametrize(
    ('words', 'at', 'wanted'), [('ja re', 1, 'record'), ('ja bench rec', 2, 'recording')]
)
def test_the_shell_completes(words: str, at: int, wanted: str) -> None:
    env = {'COMP_WORDS': words, 'COMP_CWORD': str(at), '_JA_COMPLETE': 'complete_bash'}
    done = CliRunner().invoke(app, [], prog_name='ja', env=env)
    assert wanted in done.output.split()
