"""The measurement of a graph on two machines: what its watcher counts, and the rows."""

import json
import math
import subprocess
import sys

import pytest
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.context import Context
from sensor_msgs.msg import CameraInfo, JointState, PointCloud2
from std_msgs.msg import Header

from ja_benchmarks import head_and_desktop
from ja_benchmarks.benchmarks import two_machines
from ja_benchmarks.head_and_desktop import AnswerWatcher, Measured, Split, run_split
from ja_common.core.config import ConfigError
from ja_common.time_codec import to_time
from ja_common.topics import CAMERA_INFO, EVIDENCE, GATE_STATUS, GLANCE_DELTA, LM_DELTA, SCORE
from node_bench import NodeBench

ANSWERS = {LM_DELTA: JointState, GLANCE_DELTA: JointState, EVIDENCE: PointCloud2}
SILENT = 'no complete image for 0.25 s; missing: learning_module/delta'


def status(**values: str) -> DiagnosticStatus:
    return DiagnosticStatus(values=[KeyValue(key=k, value=v) for k, v in values.items()])


def test_answers_stops_and_trials_are_counted(ros_context: Context):
    topics = [CAMERA_INFO, *ANSWERS, GATE_STATUS, SCORE]
    bench = NodeBench(ros_context, AnswerWatcher, publishes=topics)
    watcher = bench.node

    def publish_image(number: int, answers: list) -> None:
        header = Header(stamp=to_time(number * 10**8))
        bench.publish(CAMERA_INFO, CameraInfo(header=header))
        bench.wait(lambda: len(watcher._camera_s) == number)
        for topic in answers:
            bench.publish(topic, ANSWERS[topic](header=header))

    publish_image(1, list(ANSWERS))
    publish_image(2, [LM_DELTA])
    for reason in ('', SILENT, SILENT, '', SILENT, ''):
        bench.publish(GATE_STATUS, status(**({'reason': reason} if reason else {'source': 'LM'})))
    for last in ('success', 'failure'):
        bench.publish(SCORE, status(last=last))
    bench.wait(
        lambda: (
            watcher.measured.decided == 3
            and len(watcher.measured.trials) == 2
            and [len(answers) for answers in watcher._answered.values()] == [3, 1]
        )
    )
    watcher._camera_s[2 * 10**8] -= 1.0  # long ago: its answers will not come any more
    found = watcher.finish()
    assert found.delays_s[0] < 10.0
    assert math.isinf(found.delays_s[1])
    assert found.stops == {SILENT: 2}
    assert found.trials == [True, False]
    assert found.held_s > 0.0
    watcher.restart()
    assert watcher.finish() == Measured()
    bench.close()


def test_rows_of_a_run():
    measured = Measured(
        60.0,
        delays_s=[0.01, 0.02, 0.3, math.inf],
        decided=900,
        trials=[True, False],
        stops={SILENT: 3},
        held_s=6.0,
        link_bytes=600_000,
        stopped_s=[0.1, 0.2],
        resumed_s=[1.0, 3.0],
    )
    values = {name: row['value'] for name, row in two_machines.rows_of(measured).items()}
    assert values == {
        'answers within 0.25 s': 0.5,
        'images decided on': 15.0,
        'stops of the head': 3.0,
        'time held': pytest.approx(0.1),
        'trials': 2.0,
        'traffic of the link': 10.0,
        'camera to answer, median': pytest.approx(20.0),
        'camera to answer, 99th percentile': pytest.approx(294.4),
        'success': 0.5,
        'link cut for 5 s: head stands after, longest': 0.2,
        'link back: next decision after, longest': 3.0,
    }


def test_a_run_without_answers_has_rows_all_the_same():
    rows = two_machines.rows_of(Measured(10.0, delays_s=[math.inf], resumed_s=[math.inf]))
    assert rows['answers within 0.25 s']['value'] == 0.0
    assert math.isnan(rows['link back: next decision after, longest']['value'])
    assert 'success' not in rows


def test_where_no_hosts_can_be_made_one_sentence_tells_why(monkeypatch):
    monkeypatch.setattr(two_machines, 'missing', lambda: 'unshare: not permitted (needs root)')
    with pytest.raises(ConfigError, match=r'not possible here: unshare: .*needs root'):
        two_machines.run()


@pytest.mark.parametrize('fails', [False, True])
def test_what_the_near_host_prints_is_what_was_measured(fails, monkeypatch, tmp_path):
    split = Split(('learning_module',), 0.02, 0.05)
    commands = []

    def run(command, **options):
        commands.append(command)
        text = json.dumps(vars(Measured(60.0, trials=[True])))
        return subprocess.CompletedProcess(command, int(fails), text, 'Traceback: x')

    monkeypatch.setattr(head_and_desktop.subprocess, 'run', run)
    if fails:
        with pytest.raises(ConfigError, match='did not run to the end: Traceback: x'):
            run_split(split, tmp_path)
        return
    assert run_split(split, tmp_path) == Measured(60.0, trials=[True])
    assert commands[0][:3] == ['unshare', '--net', '--mount']
    assert sys.executable in commands[0]
    assert json.loads(commands[0][-2])['delay_s'] == 0.02
