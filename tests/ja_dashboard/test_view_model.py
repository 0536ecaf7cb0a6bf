"""The state of the live page, from the messages of the graph."""

import pytest

from ja_common.core.health import Level
from ja_dashboard.core.view_model import CurvePoints, NodeHealth, RunState, ViewModel


def gate(phase, source='none', **more):
    return {'phase': phase, 'source': source, 'p_lm': '0.2500', 'enabled': 'True', **more}


def health(level=Level.OK, reported_s=0.0, node='/sim', **values):
    return NodeHealth(node, level, 'fine', reported_s, values)


@pytest.fixture
def model():
    return ViewModel(now_s=0.0)


def test_a_graph_without_new_images_is_stopped_and_its_silence_is_shown(model):
    assert model.state(1.0).run is RunState.WAITING
    assert model.state(60.0).run is RunState.STOPPED
    model.record_image(1, now_s=60.0)
    model.record_gate_status(gate('shift', 'LM'))
    state = model.state(61.0)
    assert (state.run, state.is_live) == (RunState.RUNNING, True)
    assert 'learning module' in state.text
    model.record_image(1, now_s=69.0)
    state = model.state(70.0)
    assert (state.run, state.is_live) == (RunState.STOPPED, False), (
        'the same image again is not new'
    )
    assert state.text == 'no new image for 10 s'


def test_a_pause_differs_from_a_stop(model):
    model.record_health(health(paused='True'))
    model.record_image(1, now_s=0.0)
    model.record_image(1, now_s=9.0)
    assert model.state(10.0).run is RunState.PAUSED
    assert model.switches()['sim/pause'] is True
    assert model.state(20.0).run is RunState.STOPPED, 'a silent simulation is not paused'


def test_a_held_head_shows_the_reason(model):
    model.record_image(1, now_s=0.0)
    model.record_gate_status(gate('look', reason='disabled'))
    state = model.state(0.1)
    assert (state.run, state.text) == (RunState.HELD, 'the gate holds the head: disabled')


def test_a_new_viewer_does_not_see_a_stop(model):
    model.record_image(1, now_s=0.0)
    model.reset_silence(now_s=100.0)
    assert model.state(100.5).run is RunState.RUNNING


def trial(model, *shifts, fixated):
    model.record_gate_status(gate('look', 'face'))
    for source in shifts:
        model.record_gate_status(gate('shift', source))
    if fixated:
        model.record_fixation()
    model.record_gate_status(gate('look'))


def test_a_fixation_belongs_to_the_source_of_the_last_shift(model):
    trial(model, 'VF', 'LM', fixated=True)
    trial(model, 'LM', 'VF', fixated=True)
    trial(model, 'LM', fixated=True)
    trial(model, 'LM', fixated=False)
    facts = model.facts()
    assert facts['fixated by LM'] == '50% of 4'
    assert facts['fixated by VF'] == '25% of 4'
    assert facts['given up'] == '25% of 4'


def test_each_weight_file_has_a_line_of_its_own(model):
    assert 'weight files' not in model.facts()
    model.weight_files = {'iris.onnx': 64 * 'b', 'face.onnx': 64 * 'a'}
    shown = model.facts()['weight files'].splitlines()
    assert shown == [f'face.onnx={16 * "a"}', f'iris.onnx={16 * "b"}']


def test_the_success_rate_comes_with_its_interval(model):
    model.record_gate_status(gate('look'))
    for success in (True, True, False, False):
        model.record_trial(success, now_s=1.0)
    assert model.facts()['success, last 4'] == '0.50 [0.15, 0.85]'
    points = model.curve_points(now_s=1.0)
    assert points.trials == [1, 2, 3, 4]
    assert points.rate == pytest.approx([1.0, 1.0, 2 / 3, 0.5], abs=1e-3)
    interval = (points.low[-1], points.high[-1])
    assert interval == pytest.approx(model.curve.rate().interval, abs=1e-3)
    assert points.p_lm == [0.25] * 4


def test_a_long_curve_is_thinned_and_drawn_once_a_second(model):
    model.record_gate_status(gate('look'))
    for number in range(1001):
        model.record_trial(number % 2 == 0, now_s=0.0)
    points = model.curve_points(now_s=0.0)
    assert len(points.trials) <= 201
    assert points.trials[-1] == 1001
    model.record_trial(True, now_s=0.1)
    assert model.curve_points(now_s=0.5) is points
    assert model.curve_points(now_s=1.5).trials[-1] == 1002
    assert CurvePoints.of(model.curve) == model.curve_points(now_s=9.0)


def test_a_node_that_falls_silent_goes_stale(model):
    model.record_health(health(Level.WARN, 0.0, '/gate'))
    model.record_health(health(reported_s=4.0))
    nodes = {shown.node: shown for shown in model.node_health(now_s=5.0)}
    assert nodes['/sim'].level is Level.OK
    assert nodes['/gate'].level is Level.STALE
    assert nodes['/gate'].message == 'silent for 5 s'


def test_the_log_numbers_its_lines_and_drops_the_oldest(model):
    for number in range(300):
        model.append_log(f'line {number}')
    assert len(model.log) == 200
    assert model.log[-1] == (300, 'line 299')
