"""The packages' manifests are true: dependencies, versions, names, licences, pytest for colcon."""

import ast
import configparser
import re
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from bootstrap.plan import PARTS
from ja_runner.graph import rig_graph

ROOT = Path(__file__).parent.parent
SOURCES = ROOT / 'ros2_ws' / 'src'
PACKAGES = sorted(path.parent.name for path in SOURCES.glob('*/package.xml'))
MANIFESTS = {
    package: ElementTree.parse(SOURCES / package / 'package.xml').getroot() for package in PACKAGES
}

ROSDEP_KEYS = {
    'cv2': 'python3-opencv',
    'fastapi': 'python3-fastapi',
    'gymnasium': 'python3-gymnasium-pip',
    'jinja2': 'python3-jinja2',
    'matplotlib': 'python3-matplotlib',
    'mujoco': 'python3-mujoco-pip',
    'numba': 'python3-numba',
    'numpy': 'python3-numpy',
    'psutil': 'python3-psutil',
    'rich': 'python3-rich',
    'scipy': 'python3-scipy',
    'torch': 'python3-torch',
    'typer': 'python3-typer',
    'uvicorn': 'python3-uvicorn',
    'yaml': 'python3-yaml',
}
# rosdep has no key for these; pip installs them from requirements/.
WITHOUT_KEY = {'distributed', 'lz4', 'markdown_it', 'mcap', 'nicegui', 'pyarrow', 'zstandard'}
# Libraries whose name in requirements/*.in is not that of the module.
DISTRIBUTIONS = {
    'cv2': 'opencv-python-headless',
    'markdown_it': 'markdown-it-py',
    'yaml': 'pyyaml',
}
# Imported inside functions only, so that the package works without them: a rig may leave them out.
OPTIONAL = {
    'ja_bringup': {'ja_benchmarks', 'ja_experiments', 'ja_sim'},
    'ja_caregiver': {'ja_sim'},
    'ja_recording': {'ja_sim'},
}
# Whole modules that need an optional package: nothing of their own package imports them, and other
# packages do so inside functions only.
NEEDS_OPTIONAL = {
    'ja_caregiver': {'core/rehearsal.py', 'core/photo_head.py', 'film_session_node.py'}
}
# `./ja rig` starts these nodes by name.
STARTED_BY_NAME = {'ja_bringup': {node.package for node in rig_graph()}}


def imports_of(package: str, lazy: bool = True) -> set[str]:
    """Return the top-level modules that a package imports, without itself and Python's own.

    `lazy`: with those that are imported inside functions.
    """
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.Import):
            found.update(alias.name.split('.')[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            found.add(node.module.split('.')[0])
        for child in ast.iter_child_nodes(node):
            if lazy or not is_lazy(child):
                visit(child)

    root = SOURCES / package / package
    for path in root.rglob('*.py'):
        optional = path.relative_to(root).as_posix() in NEEDS_OPTIONAL.get(package, set())
        if lazy or not optional:
            visit(ast.parse(path.read_text()))
    return found - {package} - set(sys.stdlib_module_names)


def is_lazy(node: ast.AST) -> bool:
    """Return whether the importing of a module leaves out what is in this syntax node."""
    if isinstance(node, ast.If):
        return ast.unparse(node.test) == 'TYPE_CHECKING'
    return isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)


def depends(package: str, kind: str) -> list[str]:
    return [node.text or '' for node in MANIFESTS[package].findall(kind)]


def required_modules(requirements: str) -> set[str]:
    """Return the distributions that a requirements/*.in names."""
    lines = (ROOT / 'requirements' / requirements).read_text().splitlines()
    return {re.split(r'[\[<>=]', line)[0] for line in lines if line and not line.startswith('#')}


def test_packages_were_found():
    assert len(PACKAGES) == 14


@pytest.mark.parametrize('package', PACKAGES)
def test_the_declared_dependencies_are_the_imports(package):
    modules = imports_of(package) | STARTED_BY_NAME.get(package, set())
    modules -= OPTIONAL.get(package, set()) | WITHOUT_KEY
    expected = {ROSDEP_KEYS.get(module, module) for module in modules}
    declared = depends(package, 'exec_depend')
    assert set(declared) == expected
    assert len(declared) == len(expected)
    assert depends(package, 'test_depend') == ['python3-pytest']


@pytest.mark.parametrize('package', PACKAGES)
def test_what_is_imported_is_ours_or_of_ros_or_has_its_key(package):
    """So that no library escapes by being taken for a ROS package."""
    for module in imports_of(package) - set(PACKAGES) - set(ROSDEP_KEYS) - WITHOUT_KEY:
        assert module == 'rclpy' or module.endswith(('_msgs', '_srvs', '_interfaces'))


@pytest.mark.parametrize('package', OPTIONAL)
def test_optional_packages_are_imported_inside_functions_only(package):
    assert not OPTIONAL[package] & imports_of(package, lazy=False)


def test_no_part_of_a_rig_imports_a_part_that_may_be_left_out():
    left_out = {package for part in PARTS.values() for package in part}
    for package in set(PACKAGES) - left_out:
        assert not left_out & imports_of(package, lazy=False)
        assert left_out & imports_of(package) <= OPTIONAL.get(package, set())


def test_every_library_is_required_by_the_file_of_its_part():
    base = required_modules('base.in')
    for package in PACKAGES:
        parts = [part for part, packages in PARTS.items() if package in packages]
        allowed = base.union(*(required_modules(f'{part}.in') for part in parts))
        libraries = imports_of(package) & (set(ROSDEP_KEYS) | WITHOUT_KEY)
        assert {DISTRIBUTIONS.get(module, module) for module in libraries} <= allowed


@pytest.mark.parametrize('lock', ['base.lock', *(f'{part}.lock' for part in PARTS)])
def test_the_locks_agree_with_one_another(lock):
    """A distribution has one pin for each Python, wherever it is locked."""

    def pins(name: str) -> dict[str, set[str]]:
        found: dict[str, set[str]] = {}
        for line in (ROOT / 'requirements' / name).read_text().splitlines():
            if '==' in line and not line.startswith('#'):
                distribution, version = line.split(';')[0].strip(' \\').split('==')
                found.setdefault(distribution.partition('[')[0], set()).add(version)
        return found

    base = pins('base.lock')
    for distribution, versions in pins(lock).items():
        assert versions == base.get(distribution, versions)


@pytest.mark.parametrize(
    'lock', sorted((ROOT / 'requirements').glob('*.lock')), ids=lambda p: p.name
)
def test_every_pin_has_hashes_but_that_of_torch(lock):
    """Torch comes in builds for the CPU and for GPUs, of which the machine chooses one."""
    text = re.sub(r'^#.*\n', '', lock.read_text(), flags=re.M)
    pins = re.split(r'^(?=\S)', text, flags=re.M)[1:]
    without = [pin.split('==')[0] for pin in pins if '--hash=sha256:' not in pin]
    assert without == (['torch'] if lock.name == 'torch.lock' else [])


def test_there_is_one_version():
    [version] = {manifest.findtext('version') for manifest in MANIFESTS.values()}
    newest = re.search(r'^## \[(\d+\.\d+\.\d+)\]', (ROOT / 'CHANGELOG.md').read_text(), re.M)
    assert newest is not None
    assert newest[1] == version


@pytest.mark.parametrize('package', PACKAGES)
def test_the_manifest_is_complete(package):
    manifest, first = MANIFESTS[package], MANIFESTS[PACKAGES[0]]
    assert manifest.get('format') == '3'
    assert manifest.findtext('name') == package
    assert manifest.findtext('license') == 'Apache-2.0'
    assert manifest.findtext('description')
    for tag in ('maintainer', 'url'):
        assert [(node.text, node.attrib) for node in manifest.findall(tag)] == [
            (node.text, node.attrib) for node in first.findall(tag)
        ]
    assert manifest.find('maintainer').get('email')
    assert manifest.find('url').get('type') == 'repository'
    assert manifest.findtext('export/build_type') == 'ament_python'


@pytest.mark.parametrize('package', PACKAGES)
def test_setup_py_takes_everything_from_the_manifest(package):
    """The packages' setup.py differ in their executables alone."""

    def frame(name: str) -> str:
        text = (SOURCES / name / 'setup.py').read_text()
        return re.sub(r'    entry_points=\{.*?\n    \},\n', '', text, flags=re.S)

    assert frame(package) == frame(PACKAGES[0])
    assert "MANIFEST.findtext('version')" in frame(package)
    assert package not in frame(package)


@pytest.mark.parametrize('package', PACKAGES)
def test_setup_cfg_lets_colcon_find_the_tests(package):
    config = configparser.ConfigParser()
    config.read(SOURCES / package / 'setup.cfg')
    [folder] = config['tool:pytest']['testpaths'].split()
    assert (SOURCES / package / folder).resolve() == ROOT / 'tests' / package
    assert (ROOT / 'tests' / package).is_dir()
    assert dict(config['tool:pytest'], testpaths='') == _first_config()
    assert config['develop']['script_dir'] == f'$base/lib/{package}'
    assert config['install']['install_scripts'] == f'$base/lib/{package}'


def _first_config() -> dict[str, str]:
    config = configparser.ConfigParser()
    config.read(SOURCES / PACKAGES[0] / 'setup.cfg')
    return dict(config['tool:pytest'], testpaths='')


@pytest.mark.parametrize('package', PACKAGES)
def test_a_package_carries_its_types_and_a_page_about_itself(package):
    assert (SOURCES / package / package / 'py.typed').exists()
    page = (SOURCES / package / 'README.md').read_text()
    assert page.startswith(f'# {package}\n')
    nodes = (SOURCES / package / package).glob('*_node.py')
    for node in {path.stem.removesuffix('_node') for path in nodes} - {'graph'}:
        assert f'| `{node}` |' in page
    for link in re.findall(r'\]\(([^)]+)\)', page):
        assert (SOURCES / package / link).exists()
