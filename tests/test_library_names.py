"""Our code uses no name of a library that the libraries of Ubuntu 24.04 lack.

The names alone take no time to compare; `test_ubuntu_24_04.py` (slow) installs these libraries.
"""

import ast
import re
from pathlib import Path

import pytest

from library_names import MODULES, newer_names, uses_of_libraries

ROOT = Path(__file__).parent.parent
SOURCES = sorted(
    path for folder in ('ros2_ws/src', 'tests') for path in (ROOT / folder).rglob('*.py')
)
PAGES = sorted((ROOT / 'docs').rglob('*.md'))
_BLOCK = re.compile(r'^```python\n(.*?)^```', re.MULTILINE | re.DOTALL)
# `./ja bench` alone installs a new opencv-contrib for this one, in a process of its own.
_OWN_LIBRARIES = {'cv2_saliency.py'}


@pytest.fixture(scope='module')
def sources() -> dict[str, str]:
    """Return the text of every source by its place, those in the pages of docs/ as well."""
    texts = {
        str(path.relative_to(ROOT)): path.read_text()
        for path in SOURCES
        if path.name not in _OWN_LIBRARIES
    }
    for page in PAGES:
        for i, block in enumerate(_BLOCK.findall(page.read_text()), 1):
            texts[f'{page.relative_to(ROOT)}, block {i}'] = block
    return texts


def newer_in(source: str) -> list[tuple[int, str]]:
    """Return the line and name of each use of what Ubuntu 24.04's libraries lack."""
    newer = newer_names()
    # Most sources have none of these words, and need no parsing.
    if not set(re.findall(r'\w+', source)) & set().union(*newer.values()):
        return []
    return [
        (use.line, f'{use.module}.{use.name}')
        for use in uses_of_libraries(ast.parse(source))
        if use.name in newer.get(use.module, ())
    ]


def test_no_name_is_newer_than_ubuntu_24_04(sources: dict[str, str]) -> None:
    found = [
        f'{place}:{line}: {name}'
        for place, source in sources.items()
        for line, name in newer_in(source)
    ]
    assert not found, 'Ubuntu 24.04 lacks these names: use older ones, or ask hasattr(...) first'


def test_every_module_that_is_used_was_compared(sources: dict[str, str]) -> None:
    """`MODULES` of library_names.py has each module of these libraries that our code imports."""
    roots = '|'.join({module.partition('.')[0] for module in MODULES})
    imports = re.compile(rf'^\s*(?:import|from) ((?:{roots})\b[\w.]*)', re.MULTILINE)
    imported = {name for source in sources.values() for name in imports.findall(source)}
    assert 'cv2' in imported
    assert imported <= set(MODULES)


@pytest.mark.parametrize(
    ('source', 'names'),
    [
        ('import cv2\ncv2.imread("a", cv2.IMREAD_COLOR_RGB)', {'cv2.IMREAD_COLOR_RGB'}),
        ('import cv2\ncv2.dnn.readNetFromTFLite("a")', {'cv2.dnn.readNetFromTFLite'}),
        ('import cv2\ncv2.aruco.ArucoDetector()', {'cv2.aruco.ArucoDetector'}),
        ('import cv2\ncv2.data.haarcascades', {'cv2.data'}),
        ('import cv2\ncv2.imreadanimation("a")', {'cv2.imreadanimation'}),
        ('import numpy as np\nnp.trapezoid([1])', {'numpy.trapezoid'}),
        ('import numpy as np\nx: np.bool = True', {'numpy.bool'}),
        ('import numpy as np\nnp.linalg.vector_norm([1])', {'numpy.linalg.vector_norm'}),
        ('from numpy.linalg import vector_norm', {'numpy.linalg.vector_norm'}),
        ('from scipy import stats\nstats.Normal()', {'scipy.stats.Normal'}),
        ('from scipy.signal import ShortTimeFFT', {'scipy.signal.ShortTimeFFT'}),
        ('import numpy as np\nnp.zeros(3).astype(int), np.linalg.norm', set()),
        # Another's names, and what is asked for before it is used.
        ('class np: pass\nnp.trapezoid', set()),
        ('import cv2\nif hasattr(cv2.aruco, "ArucoDetector"): cv2.aruco.ArucoDetector()', set()),
    ],
)
def test_newer_names_are_found_however_they_are_imported(source: str, names: set[str]) -> None:
    assert {name for _, name in newer_in(source)} == names


def test_optional_values_of_commands_are_read_by_typer_0_9() -> None:
    """It knows Optional[X], but not X | None: no command would start."""
    for path in (ROOT / 'ros2_ws/src/ja_bringup/ja_bringup').rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Subscript) and ast.unparse(node.value) == 'Annotated':
                assert '| None' not in ast.unparse(node), f'{path}:{node.lineno}'
