"""Does learning make proposals late? Image in to delta out of a learner at work, over real topics.

The learning module runs in its own process at 30 images/s. This process publishes what camera,
detector and evaluator would, and measures the time from the publication of the detections to the
arrival of the delta, with both transports. Every five images are a trial of a random face, from
which the learner is trained; every ten trials a checkpoint is written. All is measured again with
`realtime_priority`, where that is allowed.

Where it may, this process runs with a higher priority than all ordinary programs, and than the
learner, so that its own delay on a busy machine is not measured. A program that only used 60 ms of
processor time six times a second raised the 99th percentile of a learner at rest from 3.0 to
4.0 - 6.4 ms.
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ja_benchmarks.rows import Row, percentile_99, row
from ja_common.core.config import ConfigError
from ja_common.core.detection import Detection, Kind
from ja_common.core.stamps import NS_PER_S
from ja_common.detection_codec import encode_detections
from ja_common.graph_node import GraphNode
from ja_common.image_codec import encode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.private_context import private_executor
from ja_common.realtime import enable_realtime_scheduling, restore_scheduling
from ja_common.ros_defaults import apply_ros_defaults
from ja_common.status_values import status_values
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import DETECTIONS, DIAGNOSTICS, FACE_IMAGE, FIXATION, JOINT_STATES, LM_DELTA
from ja_runner.node_spec import NodeSpec
from ja_runner.running_nodes import claim_names
from ja_runner.supervisor import Supervisor

RATE_HZ = 30.0
WARM_UP_IMAGES, IMAGES = 60, 600
IMAGES_A_TRIAL = 5
OBJECTS = 5
PATIENCE_S = 5.0
# Above that of the learner in some of the conditions.
WATCH_PRIORITY = 2
# So many that an update takes longer than a trial.
MANY_STEPS = 12
CONDITIONS: dict[str, dict[str, Any]] = {
    'not learning': {'learning_enabled_at_start': False},
    'learning': {},
    'always learning': {'replay_steps': MANY_STEPS},
    'learning, real-time priority': {'realtime_priority': 1},
    'always learning, real-time priority': {'replay_steps': MANY_STEPS, 'realtime_priority': 1},
}


def run() -> dict[str, Row]:
    """Measure the fast learner: not learning, with its defaults, and always learning."""
    apply_ros_defaults()
    rows: dict[str, Row] = {}
    for name, parameters in CONDITIONS.items():
        try:
            watch = _measure(parameters)
        finally:  # the next learner and the next benchmark start with default scheduling
            restore_scheduling()
        if watch.priority.startswith('none'):
            print(f'{name}: not measured: {watch.priority}', file=sys.stderr)
            continue
        delays_ms = np.array(watch.delays_ms[WARM_UP_IMAGES:])
        rows |= {
            f'delay, median, {name}': row(delays_ms, 'ms', np.median),
            f'delay, 99th percentile, {name}': row(delays_ms, 'ms', percentile_99),
            f'delay, longest, {name}': _figure(delays_ms.max(), 'ms', len(delays_ms)),
            f'trials handed over, {name}': _figure(watch.trials, 'trials', 1),
            f'of these not yet learned in the end, {name}': _figure(watch.waiting, 'trials', 1),
        }
    return rows


def _measure(parameters: dict[str, Any]) -> '_LearnerProbe':
    with private_executor() as executor, TemporaryDirectory() as folder:
        watch = _LearnerProbe(context=executor.context)
        executor.add_node(watch)
        steps = watch.steps()

        def tick() -> bool:
            executor.spin_once(timeout_sec=0.005)
            return next(steps, 'over') == 'over'

        kept = {'learner': 'gaze_line', 'checkpoint_folder': f'{folder}/checkpoints'}
        learner = NodeSpec('ja_learning', 'learning_module', {**kept, **parameters})
        with claim_names([learner]):
            code = Supervisor([learner], Path(folder) / 'log').run(tick)
        if code:
            raise ConfigError('the learning module did not run to the end of the measurement')
        return watch


class _LearnerProbe(GraphNode):
    """A node that publishes the learner's inputs, image by image, and times its answers."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('watch', **node_kwargs)
        self._random = np.random.default_rng(0)
        self._joints = JointCodec(JointConfig())
        inputs = (JOINT_STATES, FACE_IMAGE, DETECTIONS, FIXATION)
        self._publishers_of = {topic: self.create_topic_publisher(topic) for topic in inputs}
        self._answered: tuple[int, float] = (0, 0.0)
        self.delays_ms: list[float] = []
        self.trials = self.waiting = 0
        self.priority = ''
        self.subscribe(LM_DELTA, self._on_delta)
        self.subscribe(DIAGNOSTICS, self._on_diagnostics)

    def steps(self) -> Iterator[str]:
        """Run the measurement in steps; the caller spins between them."""
        while not all(each.get_subscription_count() for each in self._publishers_of.values()):
            yield 'waiting for the learner'
        _raise_priority()
        due_s = time.monotonic()
        for number in range(WARM_UP_IMAGES + IMAGES):
            while time.monotonic() < due_s:
                yield 'waiting for the time of the next image'
            stamp_ns = int((number + 1) / RATE_HZ * NS_PER_S)
            began_s = self._publish_image(number, Header(stamp=to_time(stamp_ns)))
            late_s = time.monotonic() + PATIENCE_S
            while self._answered[0] != stamp_ns:
                if time.monotonic() > late_s:
                    raise ConfigError(f'no answer of the learner within {PATIENCE_S:g} s')
                yield 'waiting for the answer'
            self.delays_ms.append(1e3 * (self._answered[1] - began_s))
            self._publish_fixation(number, Header(stamp=to_time(stamp_ns)))
            due_s = max(due_s + 1.0 / RATE_HZ, time.monotonic())

    def _publish_image(self, number: int, header: Header) -> float:
        """Publish the results of one image; return when the detections were published [s].

        The first image of a trial is a look at the face; then the head has shifted.
        """
        looks = number % IMAGES_A_TRIAL == 0
        posture = np.zeros(2) if looks else np.array([0.2, 0.0])
        self._publishers_of[JOINT_STATES].publish(
            self._joints.encode_posture(header, posture, np.zeros(2))
        )
        seen = [_detection(Kind.OBJECT, ray) for ray in self._rays()]
        if looks:
            face = self._random.integers(0, 256, (30, 25)).astype(np.uint8)
            self._publishers_of[FACE_IMAGE].publish(encode_image(face, header.stamp, ''))
            seen.append(_detection(Kind.FACE, np.zeros(2)))
        detections = encode_detections(header, seen)
        began_s = time.perf_counter()
        self._publishers_of[DETECTIONS].publish(detections)
        return began_s

    def _publish_fixation(self, number: int, header: Header) -> None:
        ends = number % IMAGES_A_TRIAL == IMAGES_A_TRIAL - 1
        direction = np.array([0.2, 0.0]) if ends else None
        self._publishers_of[FIXATION].publish(self._joints.encode(header, direction))

    def _rays(self) -> NDArray[np.float64]:
        return self._random.uniform(-0.3, 0.3, (OBJECTS, 2))

    def _on_delta(self, message: JointState) -> None:
        self._answered = to_ns(message.header.stamp), time.perf_counter()

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = status_values(status)
            self.trials = int(values.get('trials learned', self.trials))
            self.waiting = int(values.get('of these still waiting', self.waiting))
            self.priority = values.get('real-time priority', self.priority)


def _raise_priority() -> None:
    try:
        enable_realtime_scheduling(WATCH_PRIORITY)
    except OSError as error:
        print(f'the delay of this process is measured too: {error}', file=sys.stderr)


def _detection(kind: Kind, ray: NDArray[np.float64]) -> Detection:
    x, y = map(float, ray)
    return Detection(kind, x, y, 0.0, 0.0, 9.0, 9.0, 1.0, attended=kind is Kind.FACE)


def _figure(value: float, unit: str, n: int) -> Row:
    return {'value': float(value), 'unit': unit, 'n': n, 'interval': None}
