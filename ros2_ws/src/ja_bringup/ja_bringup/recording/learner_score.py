"""A learner's curve over recorded trials: asked before every lesson, then taught it."""

import csv
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message

from ja_bringup.graph import NodeSpec
from ja_bringup.recording.drive import DrivenNode, driven
from ja_bringup.recording.message_types import message_class
from ja_bringup.recording.reader import RecordedMessage, Recording
from ja_common.core.config import ConfigError
from ja_common.core.detection import caregiver_face
from ja_common.core.geometry import angle_between
from ja_common.core.posture import PostureHistory
from ja_common.detection_codec import decode_detections
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.time_codec import to_ns
from ja_common.topics import DETECTIONS, FIXATION, JOINT_STATES, LM_DELTA, SIM_TRUTH
from ja_sim.core.score import Rate, TruthAt
from ja_sim.truth_codec import decode_truth

_NEEDED = (DETECTIONS, FIXATION, JOINT_STATES)


@dataclass(frozen=True)
class ScoredTrial:
    """One recorded trial that ended in a fixation.

    `off_rad`: angle from what the learner proposed in the look at the caregiver to what was
    fixated. `success`: was the object nearest to the proposal the one she meant? `recorded`: was
    what was fixated the one she meant? Both None without the truth of a simulation.
    """

    trial: int
    stamp_ns: int
    off_rad: float
    success: bool | None
    recorded: bool | None


class _Examiner:
    """Follows a driven learner through a recording; it alone looks at the truth."""

    def __init__(self, learner: DrivenNode) -> None:
        self._learner = learner
        value = learner.node.get_parameter
        names = [field.name for field in fields(JointConfig)]
        self._joints = JointCodec(JointConfig(**{name: value(name).value for name in names}))
        self._postures = PostureHistory()
        self._truth: TruthAt | None = None
        self._looks_at: int | None = None
        self._look: tuple[NDArray[np.float64], TruthAt | None] | None = None
        self._fixated: NDArray[np.float64] | None = None
        self._lessons = '0'
        self.trials: list[ScoredTrial] = []

    def hear(self, topic: str, message: RecordedMessage) -> None:
        """One message: ours first, then the learner's, then what it made of it."""
        decoded = deserialize_message(message.data, message_class(message.topic.type_name))
        if topic == SIM_TRUTH.name:
            self._truth = decode_truth(decoded)
        elif topic == JOINT_STATES.name:
            self._on_joint_states(decoded)
        elif topic == DETECTIONS.name:
            face = caregiver_face(decode_detections(decoded))
            if face is not None and face.attended:
                self._looks_at = to_ns(decoded.header.stamp)
        elif topic == FIXATION.name:
            self._fixated = self._joints.decode(decoded)
        for said_topic, said in self._learner.hear(message):
            if said_topic.lstrip('/') == LM_DELTA.name:
                self._on_proposal(said)
        lessons = self._learner.node.health.values.get('trials learned', '0')
        if lessons != self._lessons:
            self._lessons = lessons
            self._on_lesson(message.stamp_ns)

    def _on_joint_states(self, message: Any) -> None:
        position = self._joints.decode(message)
        if position is not None:
            velocity = self._joints.decode_velocity(message)
            self._postures.add(to_ns(message.header.stamp), position, velocity)

    def _on_proposal(self, message: Any) -> None:
        delta = self._joints.decode(message)
        stamp_ns = to_ns(message.header.stamp)
        posture = self._postures.at(stamp_ns)
        if delta is not None and posture is not None and stamp_ns == self._looks_at:
            known = self._truth if self._truth and self._truth.stamp_ns == stamp_ns else None
            self._look = (posture.position + delta, known)

    def _on_lesson(self, stamp_ns: int) -> None:
        if self._look is None or self._fixated is None:
            return
        (proposed, truth), self._look = self._look, None
        off_rad = float(angle_between(proposed, self._fixated))
        success = recorded = None
        if truth is not None and truth.attended >= 0:
            success = _nearest(truth, proposed) == truth.attended
            recorded = _nearest(truth, self._fixated) == truth.attended
        number = len(self.trials) + 1
        self.trials.append(ScoredTrial(number, stamp_ns, off_rad, success, recorded))


def score_learner(
    recording: Recording,
    arguments: Sequence[str] = (),
    progress: Callable[[int], None] = lambda stamp_ns: None,
) -> list[ScoredTrial]:
    """Drive a learning module, with these ROS arguments, through a recording.

    Raises ConfigError when the recording lacks a topic that a learner needs.
    """
    lacking = [topic.name for topic in _NEEDED if f'/{topic.name}' not in recording.topics]
    if lacking:
        raise ConfigError(f'the recording lacks {", ".join(lacking)}: nothing to learn from')
    spec = NodeSpec('ja_learning', 'learning_module', {'lockstep': True}, arguments=arguments)
    with driven(spec) as learner:
        examiner = _Examiner(learner)
        for message in recording.messages(learner.hears | {f'/{SIM_TRUTH.name}'}):
            examiner.hear(message.topic.name.lstrip('/'), message)
            progress(message.stamp_ns)
    return examiner.trials


def write_csv(trials: Sequence[ScoredTrial], path: Path) -> None:
    """One row a trial; without truth, empty where it would be needed."""
    with path.open('w', newline='') as file:
        writer = csv.DictWriter(file, [field.name for field in fields(ScoredTrial)])
        writer.writeheader()
        for trial in trials:
            row = asdict(trial)
            writer.writerow({k: int(v) if isinstance(v, bool) else v for k, v in row.items()})


def success_rate(trials: Sequence[ScoredTrial], of: str = 'success') -> Rate:
    """Share of successes among the trials of which the truth is known."""
    known = [getattr(trial, of) for trial in trials if trial.success is not None]
    return Rate(sum(known), len(known))


def _nearest(truth: TruthAt, direction: NDArray[np.float64]) -> int:
    return int(np.argmin(angle_between(truth.directions, direction)))
