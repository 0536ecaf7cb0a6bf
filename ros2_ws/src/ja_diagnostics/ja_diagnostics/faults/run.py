"""Run one fault after another in a running graph; each begins while the head turns."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ja_common.private_context import private_executor
from ja_common.ros_arguments import parameter_arguments
from ja_diagnostics.faults.catalogue import HUNG_AFTER_S, Fault, Graph, faults
from ja_diagnostics.faults.relay import AROUND, Relay
from ja_diagnostics.faults.watcher import Watcher
from ja_runner.graph import sim_graph, with_arguments
from ja_runner.node_spec import NodeSpec
from ja_runner.running_nodes import claim_names
from ja_runner.supervisor import Supervision, Supervisor

# The limits of a rig with a camera of 30 images/s; small images, so that two cores keep up.
RIG = {
    'lockstep': False, 'camera_rate_hz': 30.0, 'joint_states_per_image': 3,
    'image_width': 160, 'image_height': 120,
    'hold_after_s': 0.13, 'max_speed_rad_s': 2.0, 'max_acceleration_rad_s2': 40.0,
    'checkpoint_every_trials': 1,
}  # fmt: skip
COLUMNS = (
    'fault', 'stopped [s]', 'pause [s]', 'resumed [s]', 'trials lost', 'updates lost', 'verdict'
)  # fmt: skip
STOPS_WITHIN_S = 0.2
GOES_ON_WITHIN_S = 0.5
PATIENCE_S = 40.0
_PAGE = NodeSpec('ja_dashboard', 'view')
_BESIDE = ('scorer', _PAGE.executable)
_MOVING_RAD_S = 0.3
_TRIALS_BEFORE = 2
_LEARNER_REPORTS_S = 3.0


@dataclass(frozen=True)
class FaultOutcome:
    """What one fault did; times in seconds, None: did not happen.

    `stopped_s`: where the head has to stop, from the fault to the last command that moved it;
    else the longest time without a decision of the gate on an image. `resumed_s`: from the end of
    the fault to the next decision. `lost`: trials that the gate, and trials that the learner, no
    longer knows. `withstood`: whatever else had to hold held.
    """

    fault: str
    stops: bool
    stopped_s: float
    resumed_s: float | None
    lost: tuple[int, int]
    withstood: bool = True

    @property
    def ok(self) -> bool:
        """Return True if the head stopped or continued in time, and nothing more was lost."""
        allowed_s = STOPS_WITHIN_S if self.stops else GOES_ON_WITHIN_S
        # A killed process loses the update that it was computing.
        return (
            self.withstood and self.stopped_s <= allowed_s and self.resumed_s is not None
            and self.lost[0] <= 0 and self.lost[1] <= 1
        )  # fmt: skip

    def row(self) -> tuple[str, ...]:
        """Return the row of the table with `COLUMNS`."""
        seconds = f'{self.stopped_s:.2f}'
        resumed = 'no' if self.resumed_s is None else f'{self.resumed_s:.1f}'
        lost = (str(max(count, 0)) for count in self.lost)
        return (
            self.fault,
            *((seconds, '-') if self.stops else ('goes on', seconds)),
            resumed,
            *lost,
            'ok' if self.ok else 'NOT OK',
        )


class FaultRun:
    """A graph under a supervisor, and the faults that it is put through."""

    def __init__(
        self,
        folder: Path,
        report: Callable[[str], None],
        place: Callable[[list[NodeSpec]], list[NodeSpec]] = list,
    ) -> None:
        """Prepare the graph; `place` may return it with nodes that run on another host."""
        saved = {'trials_file': f'{folder}/trials', 'checkpoint_folder': f'{folder}/checkpoints'}
        arguments = parameter_arguments({**RIG, **saved})
        graph = [
            replace(spec, remappings={**spec.remappings, **AROUND})
            if spec.executable == 'sim'
            else spec
            for spec in place(with_arguments([*sim_graph(), _PAGE], arguments))
        ]
        self._graph: Sequence[NodeSpec] = graph
        supervision = Supervision('restart', HUNG_AFTER_S)
        self._log = folder / 'log'
        self._supervisor = Supervisor(graph, self._log, supervision, report)
        self._report = report
        self.outcomes: list[FaultOutcome] = []

    def faults(self) -> list[Fault]:
        """Return all faults of this graph; none of nodes on which no other depends."""
        nodes = [spec.executable for spec in self._graph if spec.executable not in _BESIDE]
        return faults(nodes, self._log / f'{_PAGE.executable}.log')

    def run(self, chosen: Sequence[Fault]) -> int:
        """Run these faults in turn; return the exit code of the graph."""
        with claim_names(self._graph), private_executor() as executor:
            watcher = Watcher(context=executor.context)
            relay = Relay(context=executor.context)
            executor.add_node(watcher)
            executor.add_node(relay)
            steps = self._steps(chosen, watcher, Graph(lambda: self._supervisor.pids, relay))

            def tick() -> bool:
                end_s = time.monotonic() + 0.02
                while time.monotonic() < end_s:
                    executor.spin_once(timeout_sec=0.005)
                return next(steps, 'over') == 'over'

            return self._supervisor.run(tick)

    def _steps(self, chosen: Sequence[Fault], watcher: Watcher, graph: Graph) -> Iterator[str]:
        yield from _wait(lambda: watcher.learned >= _TRIALS_BEFORE)
        for fault in chosen:
            yield from self._run_fault(fault, watcher, graph)
            self._report('  '.join(self.outcomes[-1].row()))

    def _run_fault(self, fault: Fault, watcher: Watcher, graph: Graph) -> Iterator[str]:
        yield from _wait(lambda: watcher.speed_rad_s > _MOVING_RAD_S)
        trials, learned = watcher.trials, watcher.learned
        watcher.restart_pauses()
        began_s = time.monotonic()
        fault.begin(graph)
        yield from _wait(lambda: fault.over(graph), fault.lasts_s)
        pause_s = max(watcher.longest_pause_s, time.monotonic() - watcher.decided_s)
        stopped_s = max(watcher.moved_s - began_s, 0.0)
        fault.end(graph)
        over_s = time.monotonic()
        watcher.restart_pauses()
        yield from _wait(lambda: watcher.resumed_s is not None)
        resumed_s = None if watcher.resumed_s is None else watcher.resumed_s - over_s
        # The learner reports once a second how much it has learned.
        reported_s = time.monotonic() + _LEARNER_REPORTS_S
        yield from _wait(lambda: time.monotonic() > reported_s)
        self.outcomes.append(
            FaultOutcome(
                fault.name,
                fault.stops,
                stopped_s if fault.stops else pause_s,
                resumed_s,
                (trials - watcher.trials, learned - watcher.learned),
                fault.withstood(),
            )
        )


def _wait(condition: Callable[[], bool], patience_s: float = PATIENCE_S) -> Iterator[str]:
    end_s = time.monotonic() + patience_s
    while not condition() and time.monotonic() < end_s:
        yield 'waiting'
