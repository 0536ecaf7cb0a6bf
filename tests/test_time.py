"""Time is measured by steady clocks: the wall clock is for stamps and names alone.

A person or the network may set the wall clock while a head moves.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PROGRAMS = {
    path.relative_to(ROOT).as_posix(): path.read_text()
    for folder in ('ros2_ws/src', 'bootstrap', 'tools')
    for path in sorted((ROOT / folder).rglob('*.py'))
} | {
    f'docs/{page.stem}/{index}': code
    for page in sorted((ROOT / 'docs' / 'change_it').glob('*.md'))
    for index, code in enumerate(
        re.findall(r'^```python\n(.*?)^```', page.read_text(), re.M | re.S)
    )
}

ALLOWED = {
    'ja_common/core/run_folder.py': 'time.strftime',  # the name of a folder
    'ja_experiments/datasets/looks.py': 'time.strftime',  # the date of a data set
    # The date of a meeting.
    'ja_caregiver/core/meeting_folder.py': 'time.strftime',
    'ja_recording/recorder_node.py': 'time.time_ns',  # the stamp of a message that brings none
    # The age of a stamp: it can be compared with the clock that stamps, and with no other.
    'ja_control/gate_node.py': 'self.get_clock().now().nanoseconds',
    'ja_common/graph_node.py': 'self.get_clock().now().nanoseconds',
    'ja_calibration/calibrator.py': 'self.get_clock().now().nanoseconds',
}

_WALL_CLOCK = {
    'time.time', 'time.time_ns', 'time.strftime', 'time.localtime', 'time.gmtime', 'time.ctime',
    'time.asctime', 'time.clock_gettime', 'time.clock_gettime_ns', 'datetime.now',
    'datetime.utcnow', 'datetime.today', 'date.today', 'path.getmtime', 'path.getctime',
}  # fmt: skip
_ATTRIBUTES = {
    'st_mtime', 'st_ctime', 'st_atime', 'st_mtime_ns', 'st_ctime_ns', 'st_atime_ns',
    'SYSTEM_TIME', 'ROS_TIME', 'create_rate',
}  # fmt: skip
_STEADY = 'Clock(clock_type=ClockType.STEADY_TIME)'


def wall_clock_uses(code: str) -> Iterator[str]:
    """Yield every use of a clock that may be set: readings, file times, timers, rates."""
    tree = ast.parse(code)
    steady = {
        ast.unparse(target)
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and ast.unparse(node.value).endswith(_STEADY)
        for target in node.targets
    }
    parents = {child: node for node in ast.walk(tree) for child in ast.iter_child_nodes(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == 'time':
            yield 'from time import'  # would hide which clock is read
        elif isinstance(node, ast.Attribute):
            name = '.'.join(ast.unparse(node).split('.')[-2:])
            if name in _WALL_CLOCK or node.attr in _ATTRIBUTES:
                yield ast.unparse(node)
        elif isinstance(node, ast.Call):
            function = ast.unparse(node.func)
            if function.endswith('create_timer') and not function.startswith('super()'):
                clock = next((k.value for k in node.keywords if k.arg == 'clock'), None)
                text = '' if clock is None else ast.unparse(clock)
                if not (text in steady or text.endswith(_STEADY)):
                    yield f'{function} without clock={_STEADY}'
            elif function.endswith('get_clock().now'):
                after = parents[node]
                if not (isinstance(after, ast.Attribute) and after.attr == 'to_msg'):
                    yield ast.unparse(after)


def test_time_is_measured_by_steady_clocks():
    found = {name: set(wall_clock_uses(code)) for name, code in PROGRAMS.items()}
    assert {name: uses for name, uses in found.items() if uses} == {
        name: {use} for name in PROGRAMS for path, use in ALLOWED.items() if name.endswith(path)
    }


def test_every_program_is_looked_at():
    assert len(PROGRAMS) > 200
    assert any('create_timer' in code for name, code in PROGRAMS.items() if 'docs' in name)


@pytest.mark.parametrize(
    'code',
    [
        'began_s = time.time()',
        'clock = time.time_ns',
        'from time import time',
        'datetime.datetime.now()',
        'age_s = path.stat().st_mtime',
        'os.path.getmtime(path)',
        'node.create_timer(1.0, call)',
        'node.create_timer(1.0, call, clock=self.get_clock())',
        'node.create_timer(1.0, call, clock=Clock())',
        'clock = Clock(clock_type=ClockType.SYSTEM_TIME)',
        'node.create_rate(10.0)',
        'elapsed = self.get_clock().now() - began',
        'now_s = 1e-9 * self.get_clock().now().nanoseconds',
    ],
)
def test_a_clock_that_may_be_set_is_found(code):
    assert list(wall_clock_uses(code))


@pytest.mark.parametrize(
    'code',
    [
        'time.monotonic() - time.perf_counter()',
        'stamp = self.get_clock().now().to_msg()',
        f'node.create_timer(1.0, call, clock={_STEADY})',
        f'steady = {_STEADY}\nnode.create_timer(1.0, call, clock=steady)',
    ],
)
def test_steady_clocks_and_stamps_pass(code):
    assert not list(wall_clock_uses(code))
