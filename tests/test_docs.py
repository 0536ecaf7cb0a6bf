"""The pages link to what is there, name what is there, are short, and build without warnings."""

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from graph.test_rooms import MAY_IMPORT
from ros_testing import PATIENCE_S

ROOT = Path(__file__).parent.parent
DOCS = ROOT / 'docs'
SOURCES = ROOT / 'ros2_ws' / 'src'
PAGES = sorted([*ROOT.glob('*.md'), *DOCS.rglob('*.md'), *SOURCES.glob('*/README.md')])
_LINK = re.compile(r'\]\((?!https?:)(?P<path>[^)#\s]*)(?:#(?P<heading>[^)\s]+))?\)')
_METHOD = re.compile(r'\b(?P<owner>[A-Z][A-Za-z]+)\.(?P<method>[a-z]\w*)\b')
_NODE = re.compile(r'\b[A-Z][A-Za-z]+Node\b')
_FILE_OR_MODULE = re.compile(r'`(?P<name>(ja_[a-z]+)[/.][\w/.]+)`')
# For the pages that a reader takes in at one sitting: words apart from tables and code.
FIVE_MINUTES = 1200
GENERATED = {DOCS / 'topics.md', DOCS / 'parameters.md'}
LONG_PAGES = ('learner.md', 'world.md', 'deploy.md', 'perception.md', 'paper.md')


def anchors(page: Path) -> set[str]:
    """Return the headings of a page, as they are linked to."""
    found = re.findall(r'^#+ (.+)$', page.read_text(), re.MULTILINE)
    return {re.sub(r'[^\w\- ]', '', title.lower()).replace(' ', '-') for title in found}


@cache
def members() -> dict[str, set[str]]:
    """Return the methods of each class of the packages, those of its bases included."""
    own: dict[str, set[str]] = {}
    bases: dict[str, set[str]] = {}
    for path in SOURCES.rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef):
                names = {child.name for child in node.body if isinstance(child, ast.FunctionDef)}
                own.setdefault(node.name, set()).update(names)
                bases[node.name] = {base.id for base in node.bases if isinstance(base, ast.Name)}

    def inherited(name: str) -> set[str]:
        return own.get(name, set()).union(*(inherited(base) for base in bases.get(name, ())))

    return {name: inherited(name) for name in own}


def exists(name: str) -> bool:
    """Return whether `ja_x/core/y.py`, or `ja_x.core.y` with an attribute or without, is there."""
    path = SOURCES / name.split('/')[0].split('.')[0]
    if '/' in name:
        return (path / name).exists()
    *parts, last = name.split('.')
    if (path / Path(*parts, last)).is_dir() or (path / Path(*parts, f'{last}.py')).exists():
        return True
    module = path / Path(*parts).with_suffix('.py')
    return module.exists() and re.search(rf'\b{last}\b', module.read_text()) is not None


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for link in _LINK.finditer(page.read_text()):
        target = page.parent / link['path'] if link['path'] else page
        assert target.exists(), link[0]
        if link['heading']:
            assert link['heading'] in anchors(target), link[0]


def test_links_were_found() -> None:
    assert sum(len(_LINK.findall(page.read_text())) for page in PAGES) > 30


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_and_modules_exist(page: Path) -> None:
    named = [found['name'] for found in _FILE_OR_MODULE.finditer(page.read_text())]
    assert [name for name in named if not exists(name)] == []


def test_the_page_about_perception_names_modules_that_exist() -> None:
    _, table = (DOCS / 'perception.md').read_text().split('## Where to look in', 1)
    rows = [line.split('|')[1] for line in table.splitlines() if line.startswith('| `')]
    names = [name for row in rows for name in re.findall(r'`(\w+)`', row)]
    assert len(names) > 10
    assert [name for name in names if not exists(f'ja_perception.core.{name}')] == []


def test_the_diagrams_name_methods_and_nodes_that_exist() -> None:
    text = (DOCS / 'design.md').read_text()
    methods = [(found['owner'], found['method']) for found in _METHOD.finditer(text)]
    assert len(methods) > 10
    assert [name for name in methods if name[1] not in members().get(name[0], ())] == []
    assert [name for name in _NODE.findall(text) if name not in members()] == []


def test_the_table_of_packages_is_the_rule_of_imports() -> None:
    rows = re.findall(r'^\| `(ja_\w+)` \| ([^|]+) \|', (DOCS / 'design.md').read_text(), re.M)
    stated: dict[str, set[str]] = {}
    for package, allowed in rows:
        all_above = set(stated) if allowed.strip() == 'all above' else set()
        stated[package] = all_above | set(re.findall(r'`(ja_\w+)`', allowed))
    assert stated == MAY_IMPORT


@pytest.mark.parametrize(
    'page', sorted(set(DOCS.rglob('*.md')) - GENERATED), ids=lambda page: page.stem
)
def test_a_page_begins_with_what_its_reader_can_do(page: Path) -> None:
    if page.parent.name != 'lab_notes':
        assert 'After th' in page.read_text().split('\n\n')[1]


@pytest.mark.parametrize('name', LONG_PAGES)
def test_a_page_is_read_in_five_minutes(name: str) -> None:
    text = re.sub(r'```.*?```', '', (DOCS / name).read_text(), flags=re.DOTALL)
    prose = [line for line in text.splitlines() if not line.startswith('|')]
    assert len(' '.join(prose).split()) < FIVE_MINUTES


def test_the_site_builds_without_warnings(tmp_path: Path) -> None:
    command = [sys.executable, '-m', 'mkdocs', 'build', '--strict', '--site-dir', str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0, done.stdout + done.stderr
    reference = (tmp_path / 'reference' / 'ja_control.core.command_guard.html').read_text()
    assert 'CommandGuard' in reference
    assert 'class="mermaid"' in (tmp_path / 'design.html').read_text()
