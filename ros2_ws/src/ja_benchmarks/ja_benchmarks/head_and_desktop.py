"""`python -m ja_benchmarks.head_and_desktop SPLIT FOLDER`: a graph on two hosts, a bad cable.

It runs inside the near host, which is the head's, and prints what was measured as JSON.
`run_split` starts it in namespaces of Linux, as root; all that it makes ends with it.
"""

import json
import math
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import CameraInfo

from ja_common.core.config import ConfigError
from ja_common.graph_node import GraphNode
from ja_common.private_context import private_executor
from ja_common.python_command import module_command
from ja_common.ros_arguments import parameter_arguments
from ja_common.status_values import status_values
from ja_common.time_codec import to_ns
from ja_common.topics import (
    CAMERA_INFO,
    EVERY_SCORE,
    EVIDENCE,
    GATE_STATUS,
    GLANCE_DELTA,
    LM_DELTA,
)
from ja_diagnostics.faults.cable import NEAR, Cable, Impairment, lay_cable
from ja_diagnostics.faults.hosts import (
    far_host,
    move_far_end,
    place_on_host,
    prepare_host,
    set_discovery_range,
)
from ja_diagnostics.faults.watcher import Watcher
from ja_runner.graph import sim_graph, with_arguments
from ja_runner.supervisor import Supervision, Supervisor

HOLD_AFTER_S = 0.25
"""As in the preset of `./ja rig`: without a complete image for so long the gate holds the head."""

CAMERA_RATE_HZ = 15.0
RIG = {
    'lockstep': False, 'camera_rate_hz': CAMERA_RATE_HZ, 'joint_states_per_image': 6,
    'image_width': 160, 'image_height': 120,
    'hold_after_s': HOLD_AFTER_S, 'max_speed_rad_s': 2.0, 'max_acceleration_rad_s2': 40.0,
}  # fmt: skip

_ANSWERS = (LM_DELTA, GLANCE_DELTA, EVIDENCE)
_WARM_UP_S = 5.0
_CUT_S = 5.0
_PATIENCE_S = 90.0
_MOVING_RAD_S = 0.3


@dataclass(frozen=True)
class Split:
    """Which nodes run on the far host, behind which cable, and for how long it is measured.

    `cuts`: so often the cable is cut for 5 s at the end.
    """

    far: Sequence[str]
    delay_s: float = 0.0
    loss: float = 0.0
    measure_s: float = 60.0
    cuts: int = 3
    seed: int = 0


@dataclass
class Measured:
    """What one run has shown, in seconds.

    `delays_s`: of each image, from the camera to the last of the learner's answers; infinite where
    one of them did not come. `trials`: of each finished trial, whether it was a success. `held_s`:
    for how long the head was held, of `measured_s`. `stops`: how often, by reason. `stopped_s` and
    `resumed_s`: of each cut of the cable, until the head stood, and from its end until the next
    decision (infinite: not within the patience).
    """

    measured_s: float = 0.0
    delays_s: list[float] = field(default_factory=list)
    decided: int = 0
    trials: list[bool] = field(default_factory=list)
    stops: dict[str, int] = field(default_factory=dict)
    held_s: float = 0.0
    link_bytes: int = 0
    stopped_s: list[float] = field(default_factory=list)
    resumed_s: list[float] = field(default_factory=list)


class AnswerWatcher(GraphNode):
    """Records on the head's host when the learner's answers come, and what the gate makes of them.

    `measured` may be replaced at any time, to measure from then on.
    """

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('answer_watcher', **node_kwargs)
        self.measured = Measured()
        self._camera_s: dict[int, float] = {}
        self._answered: dict[int, dict[str, float]] = {}
        self._reason = ''
        self._held_since_s = math.inf
        self.subscribe(CAMERA_INFO, self._on_camera_info)
        for topic in _ANSWERS:
            self.subscribe(topic, self._make_callback(topic.name))
        self.subscribe(GATE_STATUS, self._on_status)
        self.subscribe(EVERY_SCORE, self._on_score)

    def restart(self) -> None:
        """Forget all that was measured."""
        self.measured = Measured()
        self._camera_s, self._answered = {}, {}
        if self._reason:
            self._held_since_s = time.monotonic()

    def finish(self) -> Measured:
        """Return what was measured since `restart`."""
        found, now_s = self.measured, time.monotonic()
        for stamp_ns, camera_s in self._camera_s.items():
            answers = self._answered.get(stamp_ns, {})
            if len(answers) == len(_ANSWERS):
                found.delays_s.append(max(answers.values()) - camera_s)
            elif camera_s < now_s - HOLD_AFTER_S:  # the newest ones may still be answered
                found.delays_s.append(math.inf)
        if self._reason:
            found.held_s += now_s - self._held_since_s
        self.measured = Measured()
        return found

    def _on_camera_info(self, message: CameraInfo) -> None:
        self._camera_s[to_ns(message.header.stamp)] = time.monotonic()

    def _make_callback(self, name: str) -> Callable[[Any], None]:
        def note(message: Any) -> None:
            answers = self._answered.setdefault(to_ns(message.header.stamp), {})
            answers.setdefault(name, time.monotonic())

        return note

    def _on_status(self, message: DiagnosticStatus) -> None:
        values = status_values(message)
        reason = values.get('reason', '')
        now_s = time.monotonic()
        self.measured.decided += 'source' in values
        if reason and not self._reason:
            # What is missing stands behind the semicolon.
            stops = Counter(self.measured.stops)
            stops[reason] += 1
            self.measured.stops, self._held_since_s = dict(stops), now_s
        elif self._reason and not reason:
            self.measured.held_s += now_s - self._held_since_s
        self._reason = reason

    def _on_score(self, message: DiagnosticStatus) -> None:
        self.measured.trials.append(status_values(message).get('last') == 'success')


def run_split(split: Split, folder: Path) -> Measured:
    """Run on two hosts of its own, with logs in a folder, and return what was measured.

    Raises ConfigError when the graph did not run to the end.
    """
    command = module_command(
        'ja_benchmarks.head_and_desktop', json.dumps(asdict(split)), str(folder)
    )
    ran = subprocess.run(
        ['unshare', '--net', '--mount', *command], check=False, capture_output=True, text=True
    )
    if ran.returncode:
        raise ConfigError(f'the graph on two hosts did not run to the end: {ran.stderr[-2000:]}')
    return Measured(**json.loads(ran.stdout))


def measure(split: Split, folder: Path, cable: Cable, host: int) -> Measured:
    """Run the graph with some nodes on another host, which a process id identifies."""
    graph = with_arguments(sim_graph(split.seed), parameter_arguments(RIG))
    for executable in split.far:
        graph = place_on_host(graph, executable, host)
    supervisor = Supervisor(graph, folder / 'log', Supervision('stop'), _report)
    with private_executor() as executor:
        answers = AnswerWatcher(context=executor.context)
        watcher = Watcher(context=executor.context)
        executor.add_node(answers)
        executor.add_node(watcher)
        found: list[Measured] = []
        steps = _steps(split, cable, answers, watcher, found)

        def tick() -> bool:
            end_s = time.monotonic() + 0.02
            while time.monotonic() < end_s:
                executor.spin_once(timeout_sec=0.005)
            return next(steps, 'over') == 'over'

        code = supervisor.run(tick)
    if code or not found:
        raise ConfigError('a node has died')
    return found[0]


def _steps(
    split: Split, cable: Cable, answers: AnswerWatcher, watcher: Watcher, found: list[Measured]
) -> Iterator[str]:
    yield from _wait(lambda: answers.measured.decided > 0, _PATIENCE_S)
    yield from _wait(lambda: False, _WARM_UP_S)
    answers.restart()
    began_s, began_bytes = time.monotonic(), _link_bytes()
    yield from _wait(lambda: False, split.measure_s)
    measured = answers.finish()
    measured.measured_s = time.monotonic() - began_s
    measured.link_bytes = _link_bytes() - began_bytes
    for _ in range(split.cuts):
        yield from _wait(lambda: watcher.speed_rad_s > _MOVING_RAD_S, _PATIENCE_S)
        cut_s = time.monotonic()
        cable.cut()
        yield from _wait(lambda: False, _CUT_S)
        measured.stopped_s.append(max(watcher.moved_s - cut_s, 0.0))
        cable.join()
        joined_s = time.monotonic()
        watcher.restart_pauses()
        yield from _wait(lambda: watcher.resumed_s is not None, _PATIENCE_S)
        measured.resumed_s.append((watcher.resumed_s or math.inf) - joined_s)
        yield from _wait(lambda: False, _WARM_UP_S)
    found.append(measured)


def _wait(condition: Callable[[], bool], patience_s: float) -> Iterator[str]:
    end_s = time.monotonic() + patience_s
    while not condition() and time.monotonic() < end_s:
        yield 'waiting'


def _link_bytes() -> int:
    """Return how many bytes have passed the near end of the cable, both ways."""
    for line in Path('/proc/self/net/dev').read_text().splitlines():
        name, _, counts = line.partition(':')
        if name.strip() == NEAR:
            received, sent = counts.split()[0], counts.split()[8]
            return int(received) + int(sent)
    raise OSError(f'there is no network device {NEAR}')


def _report(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def main() -> None:
    """Measure inside the near host."""
    split, folder = Split(**json.loads(sys.argv[1])), Path(sys.argv[2])
    prepare_host()
    impairment = Impairment(split.delay_s, split.loss, split.seed)
    with lay_cable(impairment) as cable, far_host(move_far_end) as host:
        # This is safe: no link leads out of these two hosts.
        set_discovery_range('SUBNET')
        measured = measure(split, folder, cable, host)
    print(json.dumps(asdict(measured)))


if __name__ == '__main__':
    main()
