"""The learner is killed in the running graph, restarted, and continues where it was."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.node import Node

from ja_common.private_context import private_executor
from ja_common.topics import DIAGNOSTICS
from ja_runner.graph import sim_graph
from ja_runner.node_spec import NodeSpec
from ja_runner.supervisor import Supervision, Supervisor
from ros_testing import PATIENCE_S

KILLS = 2
EVERY_TRIALS = 3

pytestmark = [pytest.mark.usefixtures('domain'), pytest.mark.slow]


class LearnedTrials(Node):
    """Receives the number of trials that the learner has learned."""

    def __init__(self, context: Context) -> None:
        super().__init__('learned_trials', context=context)
        self.learned: int | None = None
        self.create_subscription(
            DiagnosticArray, DIAGNOSTICS.name, self._on_diagnostics, DIAGNOSTICS.subscriber_qos
        )

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == '/learning_module':
                values = {pair.key: pair.value for pair in status.values}
                handed_over = int(values['trials learned'])
                self.learned = handed_over - int(values['of these still waiting'])


def graph(folder: Path) -> list[NodeSpec]:
    small = {'image_width': 160, 'image_height': 120}
    kept = {'checkpoint_folder': str(folder), 'checkpoint_every_trials': EVERY_TRIALS}
    return [
        replace(node, parameters={**node.parameters, **kept})
        if node.executable == 'learning_module'
        else node
        for node in sim_graph(seed=1, sim_parameters=small)
    ]


def test_a_killed_learner_loses_few_trials_and_learns_on(tmp_path):
    with private_executor() as executor:
        counter = LearnedTrials(executor.context)
        executor.add_node(counter)
        kill_learner(counter, executor, tmp_path)


def kill_learner(counter: LearnedTrials, executor: Executor, tmp_path: Path) -> None:
    """Kill the learner `KILLS` times while the graph runs, and compare its counts of trials."""
    supervisor = Supervisor(graph(tmp_path / 'kept'), tmp_path / 'log', Supervision('restart'))
    counts: list[tuple[int, int]] = []

    def kill_and_wait() -> Iterator[None]:
        known = 0
        for _ in range(KILLS):
            yield from until(lambda known=known: (counter.learned or 0) > known + 2 * EVERY_TRIALS)
            before, pid = counter.learned, supervisor.pids['learning_module']
            os.kill(pid, signal.SIGKILL)
            yield from until(lambda pid=pid: supervisor.pids['learning_module'] != pid)
            counter.learned = None
            yield from until(lambda: counter.learned is not None)
            known = counter.learned
            counts.append((before, known))
        yield from until(lambda: counter.learned > known)

    steps = kill_and_wait()

    def tick() -> bool:
        executor.spin_once(timeout_sec=0.1)
        return next(steps, 'over') == 'over'

    assert supervisor.run(tick) == 0
    assert len(counts) == KILLS
    assert all(after >= before - EVERY_TRIALS for before, after in counts), counts
    assert 'Traceback' not in (tmp_path / 'log' / 'learning_module.log').read_text()


def until(condition: Callable[[], bool]) -> Iterator[None]:
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s, 'the learner did not continue'
        yield
