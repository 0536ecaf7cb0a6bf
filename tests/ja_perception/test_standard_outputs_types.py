"""Builds vision_msgs, hri_msgs and tf2_msgs, and runs the nodes that publish them.

Fetches packages of the index alone; about five minutes on two cores.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from built_messages import build_messages

HERE = Path(__file__).parent
TESTS = ('standard_outputs_with_types.py', 'test_standard_codec.py')


@pytest.mark.slow
@pytest.mark.skipif(shutil.which('g++') is None, reason='no compiler: apt install g++')
def test_the_nodes_with_the_real_types(tmp_path):
    additions = build_messages(HERE / 'standard_messages', tmp_path)
    process = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider',
         *(str(HERE / name) for name in TESTS)],
        cwd=HERE.parents[1], env={**os.environ, **additions}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert process.returncode == 0, process.stdout + process.stderr
    assert 'skipped' not in process.stdout
