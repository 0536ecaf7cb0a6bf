"""Which names of libraries our code uses, and which of them Ubuntu 24.04's libraries lack.

`newer_library_names.txt` lists the names that our libraries have and those of Ubuntu 24.04 do not.
Write it again with the Python of an environment of `requirements/ubuntu-24.04.txt`:

    .venv/bin/python tests/library_names.py UBUNTU_PYTHON > tests/newer_library_names.txt
"""

import ast
import importlib
import json
import subprocess
import sys
import typing
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

NEWER_NAMES = Path(__file__).with_name('newer_library_names.txt')
# `requirements/ubuntu-24.04.txt` pins the libraries of these modules.
MODULES = (
    'click', 'cv2', 'cv2.aruco', 'cv2.dnn', 'jinja2', 'jinja2.ext', 'markdown_it',
    'matplotlib', 'matplotlib.axes', 'matplotlib.backends.backend_agg',
    'matplotlib.colors', 'matplotlib.figure', 'matplotlib.lines', 'matplotlib.patches',
    'matplotlib.ticker', 'numba', 'numba.core.caching', 'numpy', 'numpy.ctypeslib', 'numpy.lib',
    'numpy.lib.format', 'numpy.lib.stride_tricks', 'numpy.linalg', 'numpy.random',
    'numpy.testing', 'numpy.typing', 'psutil', 'rich', 'rich.console', 'rich.live',
    'rich.markup', 'rich.panel', 'rich.progress', 'rich.table', 'rich.text', 'scipy',
    'scipy.integrate', 'scipy.linalg', 'scipy.ndimage', 'scipy.optimize', 'scipy.signal',
    'scipy.sparse', 'scipy.sparse.linalg', 'scipy.spatial', 'scipy.spatial.transform',
    'scipy.special', 'scipy.stats', 'typer',
    'typer.core', 'typer.models', 'typer.testing', 'yaml',
)  # fmt: skip
# The OpenCV of a distribution is one compiled module, without the Python that its wheels add.
_ONLY_IN_WHEELS = {'cv2': {'Mat', 'data', 'gapi', 'mat_wrapper', 'misc', 'version'}}
_LIBRARIES = {module.partition('.')[0] for module in MODULES}


class Use(NamedTuple):
    """One use of `name` of a library's `module`, in a line of a source."""

    line: int
    module: str
    name: str


def uses_of_libraries(tree: ast.Module) -> Iterator[Use]:
    """Yield each name of a library in a source, but not those asked for by `hasattr`."""
    modules = _imported_modules(tree)
    asked_for = {
        f'{_dotted(node.args[0])}.{ast.literal_eval(node.args[1])}'
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and _dotted(node.func) == 'hasattr'
        and isinstance(node.args[1], ast.Constant)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and _is_of_library(node.module):
            for alias in node.names:
                yield Use(node.lineno, str(node.module), alias.name)
        elif isinstance(node, ast.Attribute) and _dotted(node) not in asked_for:
            root, _, path = _dotted(node.value).partition('.')
            if root in modules:
                yield Use(node.lineno, '.'.join(filter(None, (modules[root], path))), node.attr)


@cache
def newer_names() -> dict[str, set[str]]:
    """Return, for each of MODULES, the names that Ubuntu 24.04's version of it lacks."""
    lines = NEWER_NAMES.read_text().splitlines()
    parts = (line.partition(':') for line in lines)
    return {module: set(names.split()) for module, _, names in parts}


def names_of(modules: Iterable[str]) -> dict[str, list[str]]:
    """Return the public names of each module that this Python finds."""
    found = {}
    for module in modules:
        try:
            names = dir(importlib.import_module(module))
        except ImportError:
            # cv2.aruco and the like are attributes of a module that is no package.
            parent, _, name = module.rpartition('.')
            if not parent or not hasattr(importlib.import_module(parent), name):
                continue
            names = dir(getattr(importlib.import_module(parent), name))
        # Not what the module itself imports from Python's library.
        others = {*sys.stdlib_module_names, *dir(typing), 'annotations'}
        found[module] = sorted(n for n in names if not n.startswith('_') and n not in others)
    return found


def names_of_other_python(python: str) -> dict[str, list[str]]:
    """Return `names_of(MODULES)` as another Python finds them."""
    return json.loads(subprocess.check_output([python, __file__]))


def text_of_newer_names(oldest: dict[str, list[str]]) -> str:
    """Return what newer_library_names.txt should be, given the names of the oldest libraries."""
    lines = []
    for module, names in names_of(MODULES).items():
        known = set(oldest.get(module, ())) - _ONLY_IN_WHEELS.get(module, set())
        newer = sorted(set(names) - known)
        lines.append(' '.join([f'{module}:', *newer]))
    return '\n'.join(lines) + '\n'


def _dotted(node: ast.expr) -> str:
    """Return `a.b.c` for a name or an attribute of names, else an empty text."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute) and (value := _dotted(node.value)):
        return f'{value}.{node.attr}'
    return ''


def _imported_modules(tree: ast.Module) -> dict[str, str]:
    """Return the modules of libraries by the names that they have in a source."""
    found = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if _is_of_library(alias.name):
                    root = alias.name.partition('.')[0]
                    found[alias.asname or root] = alias.name if alias.asname else root
        elif isinstance(node, ast.ImportFrom) and _is_of_library(node.module):
            for alias in node.names:
                if f'{node.module}.{alias.name}' in MODULES:
                    found[alias.asname or alias.name] = f'{node.module}.{alias.name}'
    return found


def _is_of_library(module: str | None) -> bool:
    return module is not None and module.partition('.')[0] in _LIBRARIES


if __name__ == '__main__':
    if len(sys.argv) > 1:
        print(text_of_newer_names(names_of_other_python(sys.argv[1])), end='')
    else:
        print(json.dumps(names_of(MODULES)))
