"""The soak measures the graph's processes, and separates growth from what fills only once."""

import numpy as np
import pytest

from ja_diagnostics import soak
from ja_diagnostics.soak import COLUMNS, Series, Soak
from ja_runner.node_spec import NodeSpec


def growth(values):
    times_s = list(10.0 * np.arange(len(values)))
    row = Series('memory', 'MB', times_s, list(values)).row()
    assert len(row) == len(COLUMNS)
    return float(row[3])


def test_what_grows_for_ever_grows():
    assert growth(100.0 + 0.1 * np.arange(90)) == pytest.approx(36.0)


def test_what_filled_at_the_beginning_does_not():
    assert growth(np.minimum(100.0 + 5.0 * np.arange(90), 200.0)) == 0.0


def test_noise_is_no_growth():
    assert abs(growth(100.0 + np.random.default_rng(0).normal(0.0, 0.1, 300))) < 0.2


@pytest.mark.usefixtures('domain')
def test_the_processes_of_a_graph_are_measured(tmp_path, monkeypatch):
    monkeypatch.setattr(soak, '_SAMPLE_EVERY_S', 0.2)
    run = Soak([NodeSpec('ja_control', 'visual_feedback_controller')], tmp_path, print)
    assert run.run(5.0) == 0
    series = {each.name: each for each in run.series()}
    memory = series['memory of visual_feedback_controller']
    assert 20.0 < memory.values[-1] < 2000.0, 'MB of a Python process with rclpy'
    processor = series['processor, visual_feedback_controller']
    assert 0.0 < max(processor.values) < 800.0, '% while it starts'
    assert series['shared memory'].values[-1] > 0.1, 'MB that Fast DDS has mapped'
    assert any(name.startswith('rate, /visual_feedback_controller receives ') for name in series)
