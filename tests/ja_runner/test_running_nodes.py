"""A domain in which nodes of the same names run already is refused, before anything starts."""

import ast
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import rclpy

from ja_common.core.config import ConfigError
from ja_common.private_context import private_context
from ja_runner import running_nodes
from ja_runner.graph import with_arguments
from ja_runner.node_spec import NodeSpec
from ja_runner.run import run_graph
from ja_runner.running_nodes import claim_names

SOURCES = Path(__file__).parents[2] / 'ros2_ws' / 'src'
GRAPH = [
    NodeSpec('ja_control', 'gate', {'seed': 3}),
    NodeSpec('ja_sim', 'sim', {}, {'image_raw': 'wide/image_raw'}),
]
LEFT = with_arguments(GRAPH, ['-r', '__ns:=/left'])
RENAMED = [NodeSpec('ja_control', 'gate', arguments=['-r', 'gate:__node:=my_gate'])]

Start = Callable[..., None]


@pytest.fixture
def start_node(domain: int) -> Iterator[Start]:
    """Return a function that starts a node by hand, in a participant of its own."""
    with ExitStack() as ending:

        def start(name: str, namespace: str = '') -> None:
            context = ending.enter_context(private_context(domain_id=domain))
            node = rclpy.create_node(name, namespace=namespace, context=context)
            ending.callback(node.destroy_node)

        yield start


def no_wait(_: float) -> None:
    raise AssertionError('it waits')


@pytest.mark.usefixtures('domain')
@pytest.mark.parametrize('graph', [GRAPH, LEFT, RENAMED], ids=['plain', 'namespace', 'renamed'])
def test_an_empty_domain_is_free_without_waiting(graph, monkeypatch):
    monkeypatch.setattr(time, 'sleep', no_wait)
    for _ in range(2):  # the second time after the first graph has ended
        with claim_names(graph):
            pass


@pytest.mark.parametrize(
    ('graph', 'node', 'full_name'),
    [
        (GRAPH, ('gate', ''), '/gate'),
        (GRAPH, ('sim', '/'), '/sim'),
        (LEFT, ('gate', '/left'), '/left/gate'),
        (RENAMED, ('my_gate', ''), '/my_gate'),
    ],
    ids=['gate', 'sim', 'namespace', 'renamed'],
)
def test_a_node_of_the_same_full_name_is_named(
    start_node, domain, monkeypatch, graph, node, full_name
):
    monkeypatch.setattr(running_nodes, '_DISCOVERY_S', 20.0)
    monkeypatch.setattr(running_nodes, '_KILLED_IS_LISTED_S', 0.1)
    start_node(*node)
    text = f'ROS_DOMAIN_ID {domain} there is already {full_name}: '
    with pytest.raises(ConfigError, match=text), claim_names(graph):
        pass


def test_nodes_of_other_full_names_are_no_reason(start_node, monkeypatch):
    """They are seen, which the node of another name shows, and nothing is refused."""
    monkeypatch.setattr(running_nodes, '_DISCOVERY_S', 0.5)
    for node in (('gate', '/right'), ('view', ''), ('my_gate', '')):
        start_node(*node)
    with claim_names(GRAPH), claim_names(LEFT):
        pass


@pytest.mark.usefixtures('domain')
def test_two_graphs_that_start_at_the_same_moment_do_not_both_run():
    """No discovery is as fast as that: the claims of this machine decide."""
    with claim_names(GRAPH):
        for other in (GRAPH, GRAPH[:1], [NodeSpec('my_lab', 'sim')]):
            with pytest.raises(ConfigError, match=r'already /(gate|sim)'), claim_names(other):
                pass
        with claim_names(LEFT), claim_names(RENAMED):
            pass
    with claim_names(GRAPH):
        pass


CLAIMING = """
from ja_runner.node_spec import NodeSpec
from ja_runner.running_nodes import claim_names
with claim_names([NodeSpec('ja_control', 'gate')]):
    print('claimed', flush=True)
    input()
"""


@pytest.mark.usefixtures('domain')
def test_a_killed_graph_leaves_no_claim():
    process = subprocess.Popen(
        [sys.executable, '-c', CLAIMING], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == 'claimed\n'
    with pytest.raises(ConfigError), claim_names(GRAPH):
        pass
    process.kill()
    process.communicate()
    with claim_names(GRAPH):
        pass


def test_names_of_a_graph_that_has_just_been_killed_are_waited_for(start_node, monkeypatch):
    """They are listed until the lease of their participant ends."""
    start_node('other')  # so that the domain is not empty
    listed = [[('gate', '/')]] * 5 + [[]]

    class Probe:
        def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
            return listed.pop(0) if len(listed) > 1 else listed[0]

        def destroy_node(self) -> None:
            pass

    monkeypatch.setattr(running_nodes.rclpy, 'create_node', lambda *_, **__: Probe())
    with claim_names(GRAPH):
        assert listed == [[]]


def test_many_names_are_counted():
    many = [NodeSpec('my_lab', f'node_{index}') for index in range(7)]
    text = r'already /node_0, /node_1, /node_2 and 4 more: end that graph'
    with claim_names(many), pytest.raises(ConfigError, match=text), claim_names(many):
        pass


@pytest.mark.usefixtures('domain')
@pytest.mark.parametrize('one_process', [False, True])
def test_a_graph_does_not_start_beside_one_of_the_same_names(one_process, tmp_path):
    with claim_names(GRAPH), pytest.raises(ConfigError, match='already /gate, /sim'):
        run_graph(GRAPH, tmp_path, 'title', lambda _: True, one_process=one_process)
    assert not list(tmp_path.iterdir()), 'no node was started'


def test_all_that_starts_a_graph_claims_its_names():
    """All but `record` and `replay`: one node, which may run more than once.

    And but the benchmark that runs in namespaces of its own, where no other graph is.
    """
    starters, claimers = set(), set()
    for path in SOURCES.glob('*/ja_*/**/*.py'):
        calls = [n for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Call)]
        names = {ast.unparse(call.func) for call in calls}
        if names & {'Supervisor', 'run_in_one_process'}:
            starters.add(path.name)
        if 'claim_names' in names:
            claimers.add(path.name)
    assert {'run.py', 'soak.py'} <= starters
    assert starters - {'record_and_replay.py', 'head_and_desktop.py'} == claimers
