"""The trials of a recording: the real `learning_module` cuts them out, as it did online.

The node, and not the trial pipeline alone, is driven: which messages make one image, and the
posture at its stamp, are then decided by the same code as in a running graph.
"""

from __future__ import annotations

import importlib
import sys
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_common.core.detection import caregiver_face
from ja_common.core.geometry import angle_between
from ja_common.detection_codec import decode_detections
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.status_values import status_values
from ja_common.time_codec import to_ns
from ja_common.topics import (
    DETECTIONS,
    FACE_IMAGE,
    FIXATION,
    GATE_STATUS,
    JOINT_STATES,
    LM_DELTA,
    SIM_TRUTH,
    Topic,
)
from ja_learning.core.track import Track
from ja_learning.core.trial import Trial
from ja_recording.core.reader import RecordedMessage, Recording
from ja_recording.driven import DrivenNode, decoded, driven
from ja_recording.recorded_stamps import RecordedStamps
from ja_recording.topic_check import check_topics

if TYPE_CHECKING:  # a rig without the simulator has recordings without a truth
    from ja_sim.core.score import TruthAt

_NEEDED = (DETECTIONS, FIXATION, JOINT_STATES)
# What is read beside what the learner reads.
_FOLLOWED = (SIM_TRUTH, GATE_STATUS, DETECTIONS)
_READ = (*_NEEDED, FACE_IMAGE, SIM_TRUTH, GATE_STATUS)
_SHIFTS = ('VF', 'LM')
# How many images the learner's answer to an image may come later than the truth about it.
_TRUTHS_KEPT = 100


@dataclass(frozen=True)
class RecordedTrial:
    """One recorded trial that ended in a fixation.

    `trial`: what the learner learned from. `look_ns`, `fixation_ns`: stamps of the image on which
    the face was last seen, and of the one on which something was fixated. `proposed`: (2,) [rad],
    where the learner would have turned from the look, before it learned from the trial. `source`:
    whose shift led to the fixation, VF or LM; None where the gate was not recorded. `truth`: at
    the look, from a simulation; None on a rig. `track`: of the learner, when it had proposed.
    """

    trial: Trial
    look_ns: int
    fixation_ns: int
    proposed: NDArray[np.float64]
    source: str | None
    truth: TruthAt | None
    track: str = str(Track())

    @property
    def attended_direction(self) -> NDArray[np.float64] | None:
        """Return the direction (2,) [rad] of the attended object, where the truth is known."""
        if self.truth is None or self.truth.attended < 0:
            return None
        return self.truth.directions[self.truth.attended]

    def is_joint_attention(self, direction: NDArray[np.float64]) -> bool | None:
        """Return whether the attended object is nearest to this direction; None without truth."""
        if self.truth is None or self.truth.attended < 0:
            return None
        nearest = int(np.argmin(angle_between(self.truth.directions, direction)))
        return nearest == self.truth.attended


def recorded_trials(
    recording: Recording,
    arguments: Sequence[str] = (),
    progress: Callable[[int], None] = lambda stamp_ns: None,
) -> Iterator[RecordedTrial]:
    """Drive a learning module, with these ROS arguments, through a recording; yield its trials.

    Names are remapped as the node's: `-r detections:=/head/detections`. Why there is no trial, or
    which stamps cannot be right, is printed on stderr at the end. Raises ConfigError when the
    recording lacks a topic that a learner needs.
    """
    module = importlib.import_module('ja_learning.learning_module_node')
    ended: list[tuple[Trial, int]] = []

    def remember_trial(trial: Trial, stamp_ns: int) -> None:
        ended.append((trial, stamp_ns))

    make_node = partial(module.LearningModuleNode, on_update=remember_trial)
    with driven(make_node, ['-p', 'lockstep:=true', *arguments]) as learner:
        name_of = {topic: learner.node.resolve_topic_name(topic.name) for topic in _READ}
        check_topics(recording, name_of, _NEEDED)
        extractor = TrialExtractor(learner, ended)
        stamps = RecordedStamps([name_of[topic] for topic in (*_NEEDED, FACE_IMAGE)])
        found = False
        for message in recording.messages(learner.subscribed_topics | set(name_of.values())):
            stamps.count_message(message)
            for trial in extractor.process_message(message):
                found = True
                yield trial
            progress(message.stamp_ns)
        problems = stamps.problems()
        if not found:
            problems += _why_no_trial(recording, name_of, extractor.looks, stamps)
        for problem in problems:
            print(problem, file=sys.stderr)


def _why_no_trial(
    recording: Recording, name_of: Mapping[Topic, str], looks: int, stamps: RecordedStamps
) -> list[str]:
    """Return what a trial would have needed: a look at a face, and a fixation after it."""
    face, seen, fixations = (name_of[topic] for topic in (FACE_IMAGE, DETECTIONS, FIXATION))
    if not looks:
        return [f'no trial: {seen} never shows a face that is attended']
    if face not in recording.topics:
        return [f'no trial: the recording lacks {face}, the pictures that are learned from']
    if not stamps.share_a_stamp(seen, face):
        return [f'no trial: {seen} and {face} have no stamp in common: they are of other images']
    if not stamps.share_a_stamp(seen, fixations):
        return [f'no trial: {seen} and {fixations} have no stamp in common']
    return ['no trial: no fixation of an object followed a look at the face']


@dataclass(frozen=True)
class _Look:
    """A proposal, (2,) [rad] from where the head was, and the truth at that stamp."""

    stamp_ns: int
    delta: NDArray[np.float64]
    truth: TruthAt | None


class TrialExtractor:
    """A follower of a driven learner through a recording; it alone reads the truth."""

    def __init__(self, learner: DrivenNode, ended: list[tuple[Trial, int]]) -> None:
        """Follow this learner, whose `on_update` appends trials and their stamps to `ended`.

        `looks`: how many images so far showed an attended face.
        """
        self._learner = learner
        self._ended = ended
        value = learner.node.get_parameter
        names = [field.name for field in fields(JointConfig)]
        self._joints = JointCodec(JointConfig(**{name: value(name).value for name in names}))
        resolve = learner.node.resolve_topic_name
        self._followed = {resolve(topic.name): topic for topic in _FOLLOWED}
        self._proposals = resolve(LM_DELTA.name)
        self.looks = 0
        self._truths: deque[TruthAt] = deque(maxlen=_TRUTHS_KEPT)
        self._looks_at: int | None = None
        self._look: _Look | None = None
        self._source: str | None = None

    def process_message(self, message: RecordedMessage) -> Iterator[RecordedTrial]:
        """Use one message, then hand it to the learner; yield the trials that it has ended.

        Raises ConfigError when the message is damaged.
        """
        name = message.topic.name
        if (topic := self._followed.get(name)) is not None:
            content = decoded(message, topic.type)
            try:
                self._follow(topic, content)
            except ValueError as error:
                raise ConfigError(f'{name} at {message.stamp_ns} ns: {error}') from None
        for answer_topic, answer in self._learner.process_message(message):
            if answer_topic == self._proposals:
                self._on_proposal(answer)
        while self._ended:
            trial, stamp_ns = self._ended.pop(0)
            if trial.fixation is not None and (look := self._pop_look()) is not None:
                yield self._recorded_trial(trial, look, stamp_ns)

    def _follow(self, topic: Topic, content: Any) -> None:
        if topic is SIM_TRUTH:
            from ja_sim.truth_codec import decode_truth

            self._truths.append(decode_truth(content))
        elif topic is GATE_STATUS:
            source = status_values(content).get('source')
            self._source = source if source in _SHIFTS else self._source
        else:
            face = caregiver_face(decode_detections(content))
            if face is not None and face.attended:
                self.looks += 1
                self._looks_at, self._source = to_ns(content.header.stamp), None

    def _on_proposal(self, message: Any) -> None:
        delta = self._joints.decode(message)
        stamp_ns = to_ns(message.header.stamp)
        if delta is not None and stamp_ns == self._looks_at:
            known = (truth for truth in self._truths if truth.stamp_ns == stamp_ns)
            self._look = _Look(stamp_ns, delta, next(known, None))

    def _pop_look(self) -> _Look | None:
        look, self._look = self._look, None
        return look

    def _recorded_trial(self, trial: Trial, look: _Look, fixation_ns: int) -> RecordedTrial:
        return RecordedTrial(
            trial,
            look.stamp_ns,
            fixation_ns,
            trial.postures[0] + look.delta,
            self._source,
            look.truth,
            self._learner.node.track,
        )
