"""What every package promises: documented parameters, nodes that start, libraries in their place.

Who may import whom is held by `graph/test_rooms.py`.
"""

import ast
import dataclasses
import importlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from ja_common.core.config import ConfigError
from ja_common.topics import TOPICS

SOURCES = Path(__file__).parent.parent / 'ros2_ws' / 'src'
PACKAGES = sorted(path.name for path in SOURCES.iterdir() if path.is_dir())
TREES = {
    path.relative_to(SOURCES): ast.parse(path.read_text())
    for package in PACKAGES
    for path in sorted((SOURCES / package / package).rglob('*.py'))
}
NODES = [path for path in TREES if path.stem.endswith('_node') and path.stem != 'graph_node']

# A rig's small computer installs what its nodes need, and nothing else.
HOME_OF = {
    'torch': {'ja_learning', 'ja_experiments', 'ja_benchmarks'},
    'mujoco': {'ja_sim'},
    'numba': {'ja_experiments', 'ja_learning'},
}


def nodes_of(kind: type) -> Iterator[tuple[Path, ast.AST]]:
    """Yield every syntax node of a kind in the sources, with its file."""
    for path, tree in TREES.items():
        for node in ast.walk(tree):
            if isinstance(node, kind):
                yield path, node


def called(node: ast.AST | None) -> str:
    """Return the name of the function or method that is called; '' for anything but a call."""
    function = getattr(node, 'func', None)
    return getattr(function, 'id', getattr(function, 'attr', ''))


def is_text(node: ast.AST | None) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def test_sources_were_found():
    assert len(PACKAGES) == 14
    assert len(NODES) >= 8


def test_every_parameter_has_a_description():
    makers = ('parameter', 'interval_parameter')
    calls = [(path, node) for path, node in nodes_of(ast.Call) if called(node) in makers]
    assert len(calls) > 40
    wrong = [
        (path, node.lineno)
        for path, node in calls
        if len(node.args) < 2 or not is_text(node.args[1]) or not node.args[1].value.strip()
    ]
    assert not wrong


def test_configurations_of_nodes_consist_of_described_parameters():
    configured = {
        node.args[0].id
        for path, node in nodes_of(ast.Call)
        if path in NODES and called(node) == 'configure' and isinstance(node.args[0], ast.Name)
    }
    assert len(configured) > 8
    wrong = [
        (path, cls.name, field.target.id)
        for path, cls in nodes_of(ast.ClassDef)
        if cls.name in configured
        for field in cls.body
        if isinstance(field, ast.AnnAssign) and called(field.value) != 'parameter'
    ]
    assert not wrong


def test_parameters_are_declared_in_one_place():
    """Check it, so that every parameter has a description, a range and a check."""
    declaring = {p for p, node in nodes_of(ast.Call) if called(node) == 'declare_parameter'}
    assert declaring == {Path('ja_common/ja_common/parameters.py')}


def configurations() -> Iterator[tuple[Path, ast.ClassDef]]:
    """Yield every class that has a field made by `parameter`, with its file."""
    for path, cls in nodes_of(ast.ClassDef):
        fields = [field for field in cls.body if isinstance(field, ast.AnnAssign)]
        if any(called(field.value) in ('parameter', 'interval_parameter') for field in fields):
            yield path, cls


def test_every_configuration_is_a_frozen_dataclass_that_checks_itself():
    found = list(configurations())
    assert len(found) > 35
    wrong = [
        (path, cls.name)
        for path, cls in found
        if [ast.unparse(base) for base in cls.bases] != ['Configuration']
        or [ast.unparse(line) for line in cls.decorator_list] != ['dataclass(frozen=True)']
        or any(getattr(method, 'name', '') == '__post_init__' for method in cls.body)
    ]
    assert not wrong


@pytest.mark.parametrize(
    ('path', 'name'), [(path, cls.name) for path, cls in configurations()], ids=str
)
def test_configuration_refuses_a_value_outside_its_range(path, name):
    module = importlib.import_module('.'.join(path.with_suffix('').parts[1:]))
    config_class = getattr(module, name)
    config_class()
    for field in dataclasses.fields(config_class):
        low, high = (field.metadata.get(end) for end in ('low', 'high'))
        kind = type(field.default)
        beyond: list = [None]
        beyond += [] if low is None else [kind(low) - kind(1)]
        beyond += [] if high is None else [kind(high) + kind(1)]
        beyond += ['none of these'] if field.metadata.get('choices') else []
        for value in beyond if 'description' in field.metadata else []:
            with pytest.raises(ConfigError, match=f'^{field.name} = '):
                config_class(**{field.name: value})


@pytest.mark.parametrize('path', NODES, ids=str)
def test_node_module_ends_with_its_main(path):
    functions = [node.name for node in TREES[path].body if isinstance(node, ast.FunctionDef)]
    assert functions[-1] == 'main'
    classes = [node.name for node in TREES[path].body if isinstance(node, ast.ClassDef)]
    thing = path.stem.removesuffix('_node').title().replace('_', '')
    assert f'{thing}Node' in classes


# What variables that hold one of rclpy's objects are called, and names private to these.
_OF_RCLPY = {'node', '_node', 'executor', '_executor', 'subscription', 'publisher', 'context'}
_PRIVATE_NAMES = {
    'handle', '_parameters', '_parameter_overrides', '_callback_type', '_sigint_gc', '_tasks_lock',
    '_spin_once_impl', 'get_c_qos_profile', 'destroy_when_not_in_use', 'rclpy_implementation',
}  # fmt: skip


def test_private_api_of_rclpy_is_used_in_one_module():
    imports = {
        path
        for path, node in nodes_of(ast.ImportFrom)
        for part in (f'{node.module}.{alias.name}' for alias in node.names)
        if part.startswith('rclpy.impl') or re.match(r'rclpy\b.*\._', part)
    }
    ros = {path for path, node in nodes_of(ast.ImportFrom) if 'rclpy' in (node.module or '')}
    ros |= set(NODES)
    uses = {
        path
        for path, node in nodes_of(ast.Attribute)
        if path in ros
        and (node.attr in _PRIVATE_NAMES or (node.attr[0] == '_' and _holder(node) in _OF_RCLPY))
    }
    names = {path for path, node in nodes_of(ast.FunctionDef) if node.name == '_spin_once_impl'}
    assert imports | uses | names == {Path('ja_common/ja_common/rclpy_private.py')}


def test_contexts_are_made_in_one_module():
    """Check that a node's `main`, and a benchmark's own program, are the only exceptions."""
    makers = {
        path
        for path, node in nodes_of(ast.Call)
        if ast.unparse(node.func) in ('rclpy.init', 'init', 'Context', 'rclpy.context.Context')
    }
    assert makers == {
        Path('ja_common/ja_common/private_context.py'),
        Path('ja_common/ja_common/node_main.py'),
        Path('ja_diagnostics/ja_diagnostics/image_stream.py'),
    }


def _holder(attribute: ast.Attribute) -> str:
    """Return the last name before the attribute: `node` in `self.node._parameters`."""
    return ast.unparse(attribute.value).split('.')[-1]


@pytest.mark.parametrize('package', PACKAGES)
def test_every_node_is_an_executable_of_its_package(package):
    setup = ast.parse((SOURCES / package / 'setup.py').read_text())
    scripts = {
        node.value
        for node in ast.walk(setup)
        if is_text(node) and ':main' in node.value and '_node' in node.value
    }
    things = [path for path in NODES if path.parts[0] == package]
    assert scripts == {
        f'{path.stem.removesuffix("_node")} = {package}.{path.stem}:main' for path in things
    }


@pytest.mark.parametrize('library', HOME_OF)
def test_heavy_library_is_loaded_only_where_it_is_at_home(library):
    users = {
        path.parts[0]
        for path, node in nodes_of(ast.Import)
        if any(alias.name.split('.')[0] == library for alias in node.names)
    } | {
        path.parts[0]
        for path, node in nodes_of(ast.ImportFrom)
        if (node.module or '').split('.')[0] == library
    }
    assert users <= HOME_OF[library]


def test_relative_imports_stay_in_their_folder():
    """Check that others are absolute, so that `graph/test_rooms.py` sees them."""
    wrong = [(path, node.lineno) for path, node in nodes_of(ast.ImportFrom) if node.level > 1]
    assert not wrong


def test_no_two_public_classes_share_a_name():
    homes: dict[str, list[Path]] = {}
    for path, tree in TREES.items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith('_'):
                homes.setdefault(node.name, []).append(path)
    assert len(homes) > 150
    shared = {name: paths for name, paths in homes.items() if len(paths) > 1}
    assert not shared


def test_topic_names_stand_in_their_table_alone():
    """Check that no module reaches a topic, above all the truth, by writing its name."""
    names = {topic.name for topic in TOPICS if '/' in topic.name}
    wrong = [
        (path, node.lineno, node.value)
        for path, node in nodes_of(ast.Constant)
        if isinstance(node.value, str)
        and node.value.lstrip('/') in {name.lstrip('/') for name in names}
        and path != Path('ja_common/ja_common/topics.py')
    ]
    assert not wrong
