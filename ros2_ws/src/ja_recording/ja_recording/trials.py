"""The trials of a recording, as a learner lived them: the real `learning_module` cuts them out."""

from __future__ import annotations

import importlib
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message

from ja_common.core.config import ConfigError
from ja_common.core.detection import caregiver_face
from ja_common.core.geometry import angle_between
from ja_common.detection_codec import decode_detections
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.message_types import message_class
from ja_common.status_values import status_values
from ja_common.time_codec import to_ns
from ja_common.topics import DETECTIONS, FIXATION, GATE_STATUS, JOINT_STATES, LM_DELTA, SIM_TRUTH
from ja_learning.core.trial import Trial
from ja_recording.core.reader import RecordedMessage, Recording
from ja_recording.driven import DrivenNode, driven

if TYPE_CHECKING:  # a rig without the simulator has recordings without a truth
    from ja_sim.core.score import TruthAt

_NEEDED = (DETECTIONS, FIXATION, JOINT_STATES)
_SHIFTS = ('VF', 'LM')
# So far may the learner's answer to an image lag behind the truth about it, in images.
_TRUTHS_KEPT = 100


@dataclass(frozen=True)
class RecordedTrial:
    """One recorded trial that ended in a fixation.

    `lesson`: what the learner was taught. `look_ns`, `fixation_ns`: stamps of the image on which
    the face was last seen, and of the one on which something was fixated. `proposed`: (2,) [rad],
    where the learner would have turned from the look, before it was taught. `source`: whose shift
    led to the fixation, VF or LM; None where the gate was not recorded. `truth`: at the look, from
    a simulation; None on a rig.
    """

    lesson: Trial
    look_ns: int
    fixation_ns: int
    proposed: NDArray[np.float64]
    source: str | None
    truth: TruthAt | None

    @property
    def meant(self) -> NDArray[np.float64] | None:
        """Direction (2,) [rad] of the object that she attended to, where the truth is known."""
        if self.truth is None or self.truth.attended < 0:
            return None
        return self.truth.directions[self.truth.attended]

    def is_joint_attention(self, direction: NDArray[np.float64]) -> bool | None:
        """Is the object nearest to this direction the one she meant? None without truth."""
        if self.truth is None or self.truth.attended < 0:
            return None
        nearest = int(np.argmin(angle_between(self.truth.directions, direction)))
        return nearest == self.truth.attended


def recorded_trials(
    recording: Recording,
    arguments: Sequence[str] = (),
    progress: Callable[[int], None] = lambda stamp_ns: None,
) -> Iterator[RecordedTrial]:
    """Drive a learning module, with these ROS arguments, through a recording: trial by trial.

    Raises ConfigError when the recording lacks a topic that a learner needs.
    """
    lacking = [topic.name for topic in _NEEDED if f'/{topic.name}' not in recording.topics]
    if lacking:
        raise ConfigError(f'the recording lacks {", ".join(lacking)}: nothing to learn from')
    node = importlib.import_module('ja_learning.learning_module_node')
    with driven(node.LearningModuleNode, ['-p', 'lockstep:=true', *arguments]) as learner:
        witness = TrialExtractor(learner)
        ours = {f'/{topic.name}' for topic in (SIM_TRUTH, GATE_STATUS)}
        for message in recording.messages(learner.hears | ours):
            yield from witness.hear(message.topic.name.lstrip('/'), message)
            progress(message.stamp_ns)


@dataclass(frozen=True)
class _Look:
    """What was proposed, (2,) [rad] from where the head was, and the truth of that moment."""

    stamp_ns: int
    delta: NDArray[np.float64]
    truth: TruthAt | None


class TrialExtractor:
    """Follows a driven learner through a recording; it alone looks at the truth."""

    def __init__(self, learner: DrivenNode) -> None:
        self._learner = learner
        self._teach = learner.node.teach
        self._taught: list[tuple[Trial, int]] = []
        learner.node.teach = self._on_lesson_callback
        value = learner.node.get_parameter
        names = [field.name for field in fields(JointConfig)]
        self._joints = JointCodec(JointConfig(**{name: value(name).value for name in names}))
        self._truths: deque[TruthAt] = deque(maxlen=_TRUTHS_KEPT)
        self._looks_at: int | None = None
        self._look: _Look | None = None
        self._source: str | None = None

    def hear(self, topic: str, message: RecordedMessage) -> Iterator[RecordedTrial]:
        """One message: ours first, then the learner's; the trials that it has ended."""
        decoded = deserialize_message(message.data, message_class(message.topic.type_name))
        if topic == SIM_TRUTH.name:
            from ja_sim.truth_codec import decode_truth

            self._truths.append(decode_truth(decoded))
        elif topic == GATE_STATUS.name:
            said = status_values(decoded)
            self._source = said['source'] if said.get('source') in _SHIFTS else self._source
        elif topic == DETECTIONS.name:
            face = caregiver_face(decode_detections(decoded))
            if face is not None and face.attended:
                self._looks_at, self._source = to_ns(decoded.header.stamp), None
        for said_topic, answer in self._learner.hear(message):
            if said_topic.lstrip('/') == LM_DELTA.name:
                self._on_proposal(answer)
        while self._taught:
            trial = self._on_lesson(*self._taught.pop(0))
            if trial is not None:
                yield trial

    def _on_lesson_callback(self, lesson: Trial, stamp_ns: int) -> None:
        self._taught.append((lesson, stamp_ns))
        self._teach(lesson, stamp_ns)

    def _on_proposal(self, message: Any) -> None:
        delta = self._joints.decode(message)
        stamp_ns = to_ns(message.header.stamp)
        if delta is not None and stamp_ns == self._looks_at:
            known = (truth for truth in self._truths if truth.stamp_ns == stamp_ns)
            self._look = _Look(stamp_ns, delta, next(known, None))

    def _on_lesson(self, lesson: Trial, fixation_ns: int) -> RecordedTrial | None:
        look, self._look = self._look, None
        if look is None:
            return None
        return RecordedTrial(
            lesson,
            look.stamp_ns,
            fixation_ns,
            lesson.postures[0] + look.delta,
            self._source,
            look.truth,
        )
