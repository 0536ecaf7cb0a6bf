"""The progress node collects the state of a graph, and the display shows it."""

import io
import math

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rich.console import Console
from std_msgs.msg import String

from ja_common.topics import DIAGNOSTICS, FIXATION, GATE_STATUS, SCORE, TRACK, WEIGHT_FILES
from ja_common.weight_files_codec import encode_weight_files
from ja_runner.progress import Display, ProgressNode
from node_bench import joint_state


def status(level: bytes = DiagnosticStatus.OK, name: str = '', text: str = '', **values: str):
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    return DiagnosticStatus(level=level, name=name, message=text, values=pairs)


def test_it_counts_trials_and_keeps_the_gates_state(make_bench):
    bench = make_bench(ProgressNode, publishes=[GATE_STATUS, SCORE])
    assert math.isnan(bench.node.began_s)
    assert bench.node.elapsed_s == 0
    bench.publish(GATE_STATUS, status(phase='shift', source='LM', p_lm='0.25', trials='7'))
    bench.wait(lambda: bench.node.gate)
    for last in ('success', 'failure', 'given up'):
        bench.publish(SCORE, status(last=last, objects='3'))
    bench.wait(lambda: len(bench.node.curve.records) == 3)
    assert [record.success for record in bench.node.curve.records] == [True, False, False]
    assert {record.p_lm for record in bench.node.curve.records} == {0.25}
    facts = bench.node.facts()
    assert facts['trials'] == '3'
    assert facts['phase'] == 'shift'
    assert facts['success rate, recent'].startswith('0.33 [')
    assert bench.node.elapsed_s > 0


def test_an_image_is_counted_once_whatever_the_gate_publishes(make_bench):
    bench = make_bench(ProgressNode, publishes=[GATE_STATUS, FIXATION])
    for stamp_ns in (1, 2, 2, 3):  # one was sent again
        bench.publish(FIXATION, joint_state(stamp_ns))
    for _ in range(9):  # in real time the gate reports ten times a second
        bench.publish(GATE_STATUS, status(phase='shift'))
    bench.wait(lambda: bench.received(GATE_STATUS) == 9 and bench.received(FIXATION) == 4)
    assert bench.node.images == 3


def test_a_warning_is_shown_until_it_is_over(make_bench):
    bench = make_bench(ProgressNode, publishes=[DIAGNOSTICS])
    bench.publish(
        DIAGNOSTICS, DiagnosticArray(status=[status(DiagnosticStatus.WARN, '/gate', 'no')])
    )
    bench.wait(lambda: bench.node.facts().get('/gate') == 'no')
    bench.publish(DIAGNOSTICS, DiagnosticArray(status=[status(DiagnosticStatus.OK, '/gate')]))
    bench.wait(lambda: '/gate' not in bench.node.facts())


def test_it_keeps_what_the_learner_starts_from(make_bench):
    bench = make_bench(ProgressNode, publishes=[TRACK, WEIGHT_FILES])
    assert bench.node.facts()['track'] == '-'
    bench.publish(TRACK, String(data='landmarks'))
    bench.publish(WEIGHT_FILES, encode_weight_files('/eyes', {'face.onnx': 'a' * 64}))
    bench.wait(lambda: bench.node.weight_files and bench.node.track)
    assert bench.node.facts()['track'] == 'landmarks'
    assert bench.node.weight_files == {'face.onnx': 'a' * 64}


def test_without_a_terminal_a_plain_line_is_printed(make_bench):
    node = make_bench(ProgressNode).node
    text = io.StringIO()
    with Display('title', Console(file=text)) as display:
        display.update(node)
        display.update(node)
        display.print_line('[ERROR] [gate]: [not markup]')
    first, second = text.getvalue().splitlines()
    assert first.startswith('trials: 0')
    assert second == '[ERROR] [gate]: [not markup]'


class FailingOutput(io.StringIO):
    """An output that fails with this error."""

    def __init__(self, error: OSError) -> None:
        super().__init__()
        self._error = error

    def flush(self) -> None:
        raise self._error


@pytest.mark.parametrize(
    ('error', 'gone'), [(OSError(28, 'No space left on device'), False), (BrokenPipeError(), True)]
)
def test_a_run_outlives_an_output_that_cannot_be_written(make_bench, error, gone):
    node = make_bench(ProgressNode).node
    with Display('title', Console(file=FailingOutput(error))) as display:
        display.update(node)
        display.print_line('a line')
        assert display.reader_has_gone is gone


def test_on_a_terminal_a_table_lives(make_bench):
    node = make_bench(ProgressNode).node
    text = io.StringIO()
    with Display('the title', Console(file=text, force_terminal=True, width=90)) as display:
        display.update(node)
    assert 'the title' in text.getvalue()
    assert 'waiting for the first image' in text.getvalue()


def test_what_another_node_writes_is_no_markup(make_bench):
    node = make_bench(ProgressNode).node
    node.warnings['/their_node'] = 'expected [/open] before [bold]'
    text = io.StringIO()
    with Display('the title', Console(file=text, force_terminal=True, width=90)) as display:
        display.update(node)
    assert 'expected [/open] before [bold]' in text.getvalue()
