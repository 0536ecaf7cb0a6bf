"""One fault after another in a running graph, each begun while the head turns."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ja_common.private_executor import own_executor
from ja_common.ros_arguments import parameter_arguments
from ja_diagnostics.faults.catalogue import Fault, Graph, faults
from ja_diagnostics.faults.relay import AROUND, Relay
from ja_diagnostics.faults.watcher import Watcher
from ja_runner.graph import NodeSpec, sim_graph, with_arguments
from ja_runner.supervisor import Supervisor

# A rig's limits in front of a camera of 30 images/s, small so that two cores keep up.
RIG = {
    'lockstep': False, 'camera_rate_hz': 30.0, 'joint_states_per_image': 3,
    'image_width': 160, 'image_height': 120,
    'hold_after_s': 0.13, 'max_speed_rad_s': 2.0, 'max_acceleration_rad_s2': 40.0,
    'checkpoint_every_trials': 1,
}  # fmt: skip
COLUMNS = (
    'fault', 'stopped [s]', 'pause [s]', 'resumed [s]', 'trials lost', 'lessons lost', 'verdict'
)  # fmt: skip
STOPS_WITHIN_S = 0.2
GOES_ON_WITHIN_S = 0.5
PATIENCE_S = 40.0
_MOVING_RAD_S = 0.3
_TRIALS_BEFORE = 2
_LEARNED_ANEW_S = 3.0


@dataclass(frozen=True)
class Outcome:
    """What one fault did; times in seconds, None: did not happen.

    `stopped_s`: from the fault to the last command that moved the head, where it has to stop;
    else the longest time in which no image was decided on. `resumed_s`: from the end of the fault
    to the next decision on an image. `lost`: trials that the gate, and that the learner, no longer
    knows.
    """

    fault: str
    stops: bool
    stopped_s: float
    resumed_s: float | None
    lost: tuple[int, int]

    @property
    def well(self) -> bool:
        """Was it as it has to be?"""
        allowed_s = STOPS_WITHIN_S if self.stops else GOES_ON_WITHIN_S
        # The lesson under way in a process that is killed is lost with it.
        return (
            self.stopped_s <= allowed_s and self.resumed_s is not None
            and self.lost[0] <= 0 and self.lost[1] <= 1
        )  # fmt: skip

    def row(self) -> tuple[str, ...]:
        """As shown to people, below `COLUMNS`."""
        seconds = f'{self.stopped_s:.2f}'
        resumed = 'no' if self.resumed_s is None else f'{self.resumed_s:.1f}'
        lost = (str(max(count, 0)) for count in self.lost)
        return (
            self.fault,
            *((seconds, '-') if self.stops else ('goes on', seconds)),
            resumed,
            *lost,
            'ok' if self.well else 'NOT WELL',
        )


class FaultRun:
    """The graph under a supervisor, and one fault after another, tick by tick."""

    def __init__(
        self,
        folder: Path,
        report: Callable[[str], None],
        place: Callable[[list[NodeSpec]], list[NodeSpec]] = list,
    ) -> None:
        """`place` says where else the nodes run than here."""
        kept = {'trials_file': f'{folder}/trials', 'checkpoint_folder': f'{folder}/checkpoints'}
        arguments = parameter_arguments({**RIG, **kept})
        graph = [
            replace(spec, remappings={**spec.remappings, **AROUND})
            if spec.thing == 'sim'
            else spec
            for spec in place(with_arguments(sim_graph(), arguments))
        ]
        self._graph: Sequence[NodeSpec] = graph
        self._supervisor = Supervisor(graph, folder / 'log', 'restart', report)
        self._report = report
        self.outcomes: list[Outcome] = []

    def faults(self) -> list[Fault]:
        """All faults of this graph; nobody waits for the scorer."""
        return faults([spec.thing for spec in self._graph if spec.thing != 'scorer'])

    def run(self, chosen: Sequence[Fault]) -> int:
        """These faults in turn; the exit code of the graph."""
        with own_executor() as executor:
            watcher = Watcher(context=executor.context)
            relay = Relay(context=executor.context)
            executor.add_node(watcher)
            executor.add_node(relay)
            story = self._story(chosen, watcher, Graph(lambda: self._supervisor.pids, relay))

            def tick() -> bool:
                end_s = time.monotonic() + 0.02
                while time.monotonic() < end_s:
                    executor.spin_once(timeout_sec=0.005)
                return next(story, 'over') == 'over'

            return self._supervisor.run(tick)

    def _story(self, chosen: Sequence[Fault], watcher: Watcher, graph: Graph) -> Iterator[str]:
        yield from _wait(lambda: watcher.learned >= _TRIALS_BEFORE)
        for fault in chosen:
            yield from self._one(fault, watcher, graph)
            self._report('  '.join(self.outcomes[-1].row()))

    def _one(self, fault: Fault, watcher: Watcher, graph: Graph) -> Iterator[str]:
        yield from _wait(lambda: watcher.speed_rad_s > _MOVING_RAD_S)
        trials, learned = watcher.trials, watcher.learned
        watcher.watch_pauses()
        began_s = time.monotonic()
        fault.begin(graph)
        yield from _wait(lambda: time.monotonic() - began_s > fault.lasts_s, fault.lasts_s + 1.0)
        pause_s = max(watcher.longest_pause_s, time.monotonic() - watcher.decided_s)
        stopped_s = max(watcher.moved_s - began_s, 0.0)
        fault.end(graph)
        over_s = time.monotonic()
        watcher.watch_pauses()
        yield from _wait(lambda: watcher.resumed_s is not None)
        resumed_s = None if watcher.resumed_s is None else watcher.resumed_s - over_s
        # The learner says once a second how much it has learned.
        told_s = time.monotonic() + _LEARNED_ANEW_S
        yield from _wait(lambda: time.monotonic() > told_s)
        self.outcomes.append(
            Outcome(
                fault.name,
                fault.stops,
                stopped_s if fault.stops else pause_s,
                resumed_s,
                (trials - watcher.trials, learned - watcher.learned),
            )
        )


def _wait(condition: Callable[[], bool], patience_s: float = PATIENCE_S) -> Iterator[str]:
    end_s = time.monotonic() + patience_s
    while not condition() and time.monotonic() < end_s:
        yield 'waiting'
