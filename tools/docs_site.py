"""What `./ja docs` adds to docs/: the README and its like, a reference page a module, diagrams."""

from __future__ import annotations

import ast
import importlib.util
import os
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from pygments.formatters import HtmlFormatter

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / 'ros2_ws' / 'src'
# Pages of the site that are files beside docs/.
BESIDE = {
    'index.md': ROOT / 'README.md',
    'contributing.md': ROOT / 'CONTRIBUTING.md',
    'changelog.md': ROOT / 'CHANGELOG.md',
}
# Diagrams stay readable text without a web server, or without NiceGUI.
_DRAW_DIAGRAMS = """
<script type="module">
import {mermaid} from '%s';
mermaid.initialize({startOnLoad: false});
await mermaid.run();
</script>
"""
_LINK = re.compile(r'(?P<text>\[[^\]]*\])\((?!https?:|#)(?P<path>[^)#\s]+)(?P<rest>[^)]*)\)')


def modules() -> list[str]:
    """Return the dotted names of all modules with a docstring, package by package."""
    names = []
    for path in sorted(SOURCES.glob('ja_*/ja_*/**/*.py')):
        if path.stem.startswith('_') or not ast.get_docstring(ast.parse(path.read_text())):
            continue
        names.append('.'.join(path.relative_to(SOURCES).with_suffix('').parts[1:]))
    return names


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Append the reference to the navigation, a section a package."""
    packages: dict[str, list[dict[str, str]]] = {}
    for name in modules():
        package, _, rest = name.partition('.')
        packages.setdefault(package, []).append({rest: f'reference/{name}.md'})
    config.nav = [*config.nav, {'Reference': [{p: pages} for p, pages in packages.items()]}]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages and assets that are no files of docs/."""

    def add(uri: str, **source: str) -> None:
        files.append(File.generated(config, uri, **source))

    for uri, path in BESIDE.items():
        add(uri, content=path.read_text())
    for name in modules():
        add(f'reference/{name}.md', content=f'# {name}\n\n::: {name}\n')
    style = HtmlFormatter(style='default').get_style_defs('.highlight')
    add('assets/site.css', content=f'{style}\n.wy-nav-content {{ max-width: 60em }}\n')
    for path in _mermaid_scripts():
        add(f'assets/mermaid/{path.name}', abs_src_path=str(path))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let links to files beside docs/ lead into the site, or turn them into plain text."""
    uri = page.file.src_uri
    source = BESIDE.get(uri, ROOT / 'docs' / uri)

    def relinked(link: re.Match[str]) -> str:
        target = (source.parent / link['path']).resolve()
        inside = {path: uri for uri, path in BESIDE.items()}.get(target)
        if inside is None and target.is_relative_to(ROOT / 'docs'):
            inside = str(target.relative_to(ROOT / 'docs'))
        if inside is None:
            return link['text'][1:-1]
        return f'{link["text"]}({os.path.relpath(inside, Path(uri).parent)}{link["rest"]})'

    return _LINK.sub(relinked, markdown)


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Draw the diagrams of a page."""
    if 'class="mermaid"' not in html:
        return html
    depth = page.file.src_uri.count('/')
    return html + _DRAW_DIAGRAMS % ('./' + '../' * depth + 'assets/mermaid/index.js')


def _mermaid_scripts() -> list[Path]:
    """Return the files of NiceGUI's Mermaid; none where the live page is left out."""
    found = importlib.util.find_spec('nicegui')
    if found is None or found.origin is None:
        return []
    return sorted((Path(found.origin).parent / 'elements' / 'mermaid' / 'dist').glob('*.js'))
