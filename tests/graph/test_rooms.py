"""Which package may import which, and which nodes may know the truth."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from rclpy.context import Context

from ja_common.topics import CAREGIVER_REQUEST
from ja_runner.graph import meet_graph, rig_graph, sim_graph
from ja_runner.node_spec import NodeSpec

SOURCES = Path(__file__).parents[2] / 'ros2_ws' / 'src'
MIDDLE = {'ja_perception', 'ja_control', 'ja_learning', 'ja_sim'}
MAY_IMPORT = {
    'ja_common': set(),
    **{package: {'ja_common'} for package in MIDDLE},
    'ja_recording': {'ja_common', *MIDDLE},
    'ja_dashboard': {'ja_common'},
    'ja_calibration': {'ja_common', 'ja_control'},
    'ja_caregiver': {'ja_common', 'ja_perception', 'ja_sim'},
    'ja_runner': {'ja_common'},
}
MAY_IMPORT['ja_experiments'] = {'ja_common', *MIDDLE, 'ja_recording'}
MAY_IMPORT['ja_diagnostics'] = {'ja_common', *MIDDLE, 'ja_recording', 'ja_runner'}
MAY_IMPORT['ja_benchmarks'] = {*MAY_IMPORT} - {'ja_benchmarks', 'ja_bringup'}
MAY_IMPORT['ja_bringup'] = {*MAY_IMPORT} - {'ja_bringup'}
OURS = set(MAY_IMPORT)


def imported(path: Path) -> set[str]:
    """Return the full names of all imports of a file, at any level."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f'{node.module}.{alias.name}' for alias in node.names)}
    return names


def test_every_package_has_its_rule():
    assert {path.name for path in SOURCES.iterdir() if path.is_dir()} == OURS


def imports_of(package: str) -> Iterator[tuple[Path, str]]:
    """Yield every import of a package: the file (relative to ros2_ws/src) and the full name."""
    for path in sorted((SOURCES / package / package).rglob('*.py')):
        for name in sorted(imported(path)):
            yield path.relative_to(SOURCES), name


@pytest.mark.parametrize('package', sorted(OURS))
def test_imports_run_downward(package):
    wrong = [
        (path, name)
        for path, name in imports_of(package)
        if (top := name.split('.')[0]) in OURS - {package} and top not in MAY_IMPORT[package]
    ]
    assert not wrong


@pytest.mark.parametrize('package', sorted(OURS))
def test_core_is_free_of_ros(package):
    """A core imports neither rclpy nor messages, and of our packages only their core."""
    wrong = []
    for path, name in imports_of(package):
        top, *rest = name.split('.')
        if 'core' in path.parts and (
            top == 'rclpy' or top.endswith('_msgs') or (top in OURS and rest and rest[0] != 'core')
        ):
            wrong.append((path, name))
    assert not wrong


@pytest.mark.parametrize('package', sorted(OURS))
def test_no_package_imports_a_node(package):
    wrong = [
        (path, name)
        for path, name in imports_of(package)
        if name.split('.')[0] in OURS and name.endswith('_node')
        and not name.startswith(('ja_common.graph_node', 'ja_common.node_main'))
    ]  # fmt: skip
    assert not wrong


ROBOT = ['ja_perception', 'ja_control', 'ja_learning']


@pytest.mark.parametrize('package', ROBOT)
def test_the_robot_never_knows_what_a_person_is_asked(package):
    for path in sorted((SOURCES / package / package).rglob('*.py')):
        text = path.read_text()
        assert CAREGIVER_REQUEST.name not in text, path
        assert 'CAREGIVER_REQUEST' not in text, path
        assert 'ja_caregiver' not in text, path


@pytest.mark.parametrize('package', ROBOT)
def test_the_robot_never_knows_the_truth(package):
    forbidden = ('truth', 'score')
    wrong = [
        (path, name)
        for path, name in imports_of(package)
        if any(word in name.lower() for word in forbidden)
    ]
    assert not wrong


def test_only_the_scorer_subscribes_to_the_truth(ros_context):
    """The running graph is tested here, not the source code."""
    nodes = [
        spec.load()(context=ros_context, cli_args=spec.ros_arguments())
        for spec in [*sim_graph(), *rig_graph(str(Path(__file__).parent))]
        if spec.executable != 'camera'
    ]
    subscribers = {
        node.get_name()
        for node in nodes
        for topic, _ in node.get_subscriber_names_and_types_by_node(
            node.get_name(), node.get_namespace()
        )
        if topic.startswith('/sim/')
    }
    for node in nodes:
        node.destroy_node()
    assert subscribers == {'scorer'}


def test_only_the_page_subscribes_to_what_a_person_is_asked(ros_context: Context) -> None:
    """The running graph of `./ja meet` is walked, with and without a digital head."""
    page = NodeSpec('ja_dashboard', 'view')
    graph = {spec.executable: spec for spec in (*meet_graph(str(Path(__file__).parent)), page)}
    assert graph.keys() >= {spec.executable for spec in meet_graph()}
    del graph['camera']
    nodes = [
        spec.load()(context=ros_context, cli_args=spec.ros_arguments()) for spec in graph.values()
    ]
    topic = f'/{CAREGIVER_REQUEST.name}'
    publishers, subscribers = set(), set()
    for node in nodes:
        name = node.get_name(), node.get_namespace()
        if topic in dict(node.get_publisher_names_and_types_by_node(*name)):
            publishers.add(node.get_name())
        if topic in dict(node.get_subscriber_names_and_types_by_node(*name)):
            subscribers.add(node.get_name())
        # The scorer publishes nothing else that the robot could read.
        if node.get_name() == 'request_scorer':
            published = set(node.published_topics.values())
    for node in nodes:
        node.destroy_node()
    assert publishers == {'request_scorer'}
    assert subscribers <= {'view'}
    assert {each.name for each in published} == {CAREGIVER_REQUEST.name, '/diagnostics'}
