"""Faults in the running graph: kill and freeze every node, and watch what the head does.

`python -m ja_bringup.faults` prints a table in Markdown. Each fault is done while the head
turns; the times are taken from the commands, at one listener.
"""

import os
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import JointState

from ja_bringup.graph import NodeSpec, sim_graph, with_arguments
from ja_bringup.supervisor import Supervisor
from ja_common.graph_node import GraphNode
from ja_common.ros_defaults import apply_ros_defaults
from ja_common.topics import GATE_STATUS, JOINT_COMMANDS

# A rig's limits in front of a camera of 30 images/s, small so that two cores keep up.
RIG = {
    'lockstep': 'false', 'camera_rate_hz': '30.0', 'image_width': '160', 'image_height': '120',
    'hold_after_s': '0.13', 'max_speed_rad_s': '2.0', 'max_acceleration_rad_s2': '40.0',
    'trials_file': '{folder}/trials', 'checkpoint_folder': '{folder}/checkpoints',
}  # fmt: skip
FROZEN_S = 5.0
PATIENCE_S = 40.0
MOVING_RAD_S = 0.3


@dataclass(frozen=True)
class Outcome:
    """What one fault did; times in seconds, None: did not happen.

    `stopped_s`: from the fault to the last command that moved the head before it was held.
    `resumed_s`: from the end of the fault to the next decision on an image.
    """

    fault: str
    stopped_s: float | None
    resumed_s: float | None
    trials_before: int
    trials_after: int

    def row(self) -> str:
        """The row of the table, in Markdown."""
        stopped = '-' if self.stopped_s is None else f'{self.stopped_s:.2f}'
        resumed = 'no' if self.resumed_s is None else f'{self.resumed_s:.1f}'
        kept = 'yes' if self.trials_after >= self.trials_before else 'no'
        return f'| {self.fault} | {stopped} | {resumed} | {kept} |'


class Watcher(GraphNode):
    """Notes when the command moves, and when the gate decides on an image."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('fault_watcher', **node_kwargs)
        self.moved_s = 0.0
        self.speed_rad_s = 0.0
        self.decided_s = 0.0
        self.trials = 0
        self._position: np.ndarray | None = None
        self.hear(JOINT_COMMANDS, self._on_command)
        self.hear(GATE_STATUS, self._on_status)

    def _on_command(self, message: JointState) -> None:
        position = np.array(message.position)
        self.speed_rad_s = float(np.abs(message.velocity).max()) if message.velocity else 0.0
        if self._position is not None and np.abs(position - self._position).max() > 1e-4:
            self.moved_s = time.monotonic()
        self._position = position

    def _on_status(self, message: DiagnosticStatus) -> None:
        values = {pair.key: pair.value for pair in message.values}
        self.trials = int(values.get('trials', '0'))
        if 'source' in values:
            self.decided_s = time.monotonic()


class FaultRun:
    """The graph under a supervisor, and one fault after another, tick by tick."""

    def __init__(self, folder: Path, report: Callable[[str], None]) -> None:
        settings = {name: text.format(folder=folder) for name, text in RIG.items()}
        arguments = [part for item in settings.items() for part in ('-p', ':='.join(item))]
        self._graph: list[NodeSpec] = with_arguments(sim_graph(), arguments)
        self._supervisor = Supervisor(self._graph, folder / 'log', 'restart', report)
        self.outcomes: list[Outcome] = []

    def run(self) -> int:
        """All faults; the exit code of the graph."""
        context = Context()
        rclpy.init(args=[], context=context, signal_handler_options=rclpy.SignalHandlerOptions.NO)
        executor = SingleThreadedExecutor(context=context)
        watcher = Watcher(context=context)
        executor.add_node(watcher)
        story = self._story(watcher)

        def tick() -> bool:
            end_s = time.monotonic() + 0.02
            while time.monotonic() < end_s:
                executor.spin_once(timeout_sec=0.005)
            return next(story, 'over') == 'over'

        try:
            return self._supervisor.run(tick)
        finally:
            executor.shutdown()
            watcher.destroy_node()
            context.try_shutdown()

    def _story(self, watcher: Watcher) -> Iterator[str]:
        for spec in self._graph:
            if spec.thing == 'scorer':
                continue  # nobody waits for it
            for frozen in (False, True):
                yield from self._fault(watcher, spec.thing, frozen)

    def _fault(self, watcher: Watcher, thing: str, frozen: bool) -> Iterator[str]:
        patience_s = time.monotonic() + PATIENCE_S
        while watcher.speed_rad_s < MOVING_RAD_S and time.monotonic() < patience_s:
            yield 'waiting until the head turns'
        trials, pid, began_s = watcher.trials, self._supervisor.pids[thing], time.monotonic()
        os.kill(pid, signal.SIGSTOP if frozen else signal.SIGKILL)
        over_s = began_s
        if frozen:
            while time.monotonic() - began_s < FROZEN_S:
                yield 'frozen'
            stopped_s = watcher.moved_s - began_s
            os.kill(pid, signal.SIGCONT)
            over_s = time.monotonic()
        else:
            while time.monotonic() - began_s < 0.4:
                yield 'dead'
            stopped_s = watcher.moved_s - began_s
        patience_s = time.monotonic() + PATIENCE_S
        while watcher.decided_s < over_s + 0.5 and time.monotonic() < patience_s:
            yield 'waiting for a decision'
        decided = watcher.decided_s >= over_s + 0.5
        name = f'{thing} {"frozen for 5 s" if frozen else "killed -9"}'
        self.outcomes.append(
            Outcome(
                name,
                max(stopped_s, 0.0),
                watcher.decided_s - over_s if decided else None,
                trials,
                watcher.trials,
            )
        )


def main() -> None:
    """Run all faults once and print the table."""
    apply_ros_defaults()
    with TemporaryDirectory() as folder:
        run = FaultRun(Path(folder), print)
        code = run.run()
    print('| fault | head stopped after [s] | resumed after [s] | trials kept |')
    print('|---|---|---|---|')
    for outcome in run.outcomes:
        print(outcome.row())
    raise SystemExit(code)


if __name__ == '__main__':
    main()
