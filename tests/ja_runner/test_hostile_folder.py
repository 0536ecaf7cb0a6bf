"""A node that is started in a foreign folder imports none of its files."""

import os
import subprocess

from hostile_folder import imported_from, make_hostile
from ja_runner.node_spec import NodeSpec
from ros_testing import PATIENCE_S


def test_a_node_imports_nothing_from_the_current_folder(tmp_path):
    hostile = make_hostile(tmp_path / 'hostile')
    # The bad value ends the node when everything is imported.
    gate = NodeSpec('ja_control', 'gate', {'gating': 'nonsense'})
    done = subprocess.run(
        gate.command(), cwd=hostile, env={**os.environ, 'ROS_LOG_DIR': str(tmp_path)},
        capture_output=True, text=True, timeout=PATIENCE_S,
    )  # fmt: skip
    assert 'nonsense' in done.stderr + done.stdout
    assert imported_from(hostile) == []
