"""`learning_module`: proposes where to look from the caregiver's face, and learns it online."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger

from ja_common.core.config import Configuration, parameter
from ja_common.core.detection import Detection, caregiver_face
from ja_common.core.health import Level
from ja_common.core.posture import STILL_BELOW_RAD_S, Posture
from ja_common.detection_codec import decode_detections
from ja_common.face_gaze_codec import decode_face_gaze
from ja_common.graph_node import GraphNode
from ja_common.image_codec import decode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.node_main import spin_node
from ja_common.point_cloud_codec import encode_columns
from ja_common.realtime import enable_realtime_scheduling
from ja_common.synchroniser import StampedSet, Synchroniser
from ja_common.time_codec import to_ns
from ja_common.topics import (
    BELIEF,
    DETECTIONS,
    EVIDENCE,
    FACE_GAZE,
    FACE_IMAGE,
    FIXATION,
    GLANCE_DELTA,
    INTERRUPTED,
    LM_DELTA,
    Topic,
)
from ja_learning.core.learner import Learner
from ja_learning.core.learner_registry import LEARNERS, LearnerChoice, make_learner
from ja_learning.core.look_around import LookAroundConfig
from ja_learning.core.trial import Trial, checked_face
from ja_learning.core.trial_pipeline import TrialPipeline
from ja_learning.persistent_learner import PersistentLearner


@dataclass(frozen=True)
class LearningModuleConfig(Configuration):
    """Configuration of the node beyond that of the learner."""

    seed: int = parameter(0, 'seed of the initial weights', low=0)
    learning_enabled_at_start: bool = parameter(True, 'learn from the start')
    lockstep: bool = parameter(
        False,
        'answer with what was known a trial ago, and wait for that, so that the same seed gives '
        'the same run (else nothing waits, and an update is used as soon as it is over)',
    )
    still_below_rad_s: float = parameter(
        STILL_BELOW_RAD_S, 'a joint slower than this stands still', low=1e-4, high=5.0
    )
    realtime_priority: int = parameter(
        0,
        'answer before all ordinary programs of the machine, in this process and with this '
        'priority (SCHED_RR; the thread that learns excepted); 0: as any program',
        low=0, high=99,
    )  # fmt: skip


class LearningModuleNode(GraphNode):
    """The node that proposes once an image while a trial is under way, and learns once a trial.

    Trials are learned in a thread of their own (`PersistentLearner`): no proposal waits for that.
    """

    def __init__(
        self,
        on_update: Callable[[Trial, int], None] = lambda trial, stamp_ns: None,
        **node_kwargs: Any,
    ) -> None:
        """Start the node.

        `on_update` is called with every trial that is handed to the learner, and the stamp [ns] of
        the image that has ended it.
        """
        super().__init__('learning_module', **node_kwargs)
        self._config = self.configure(LearningModuleConfig)
        self._choice = self.configure(LearnerChoice, self._choose)
        self._learner_configs = {
            kind: self.configure(entry.config) for kind, entry in LEARNERS.items()
        }
        self._joints = JointCodec(self.configure(JointConfig))
        self._learning = self._config.learning_enabled_at_start
        _share_the_interpreter()
        self._on_update = on_update
        self._learner = PersistentLearner(self, self.untrained_learner, self._config.lockstep)
        self._pipeline = TrialPipeline(
            lambda: self._learner.predictor,
            self._update,
            self.configure(LookAroundConfig),
            self._config.still_below_rad_s,
            self._config.seed,
            self._learner.mean_face,
        )
        synchroniser = Synchroniser(self, self._joints)
        # First the proposal for an image, then its update, and only then the next proposal.
        synchroniser.call_with(
            {DETECTIONS: decode_detections},
            self._propose,
            also={FACE_IMAGE: _decode_face, FACE_GAZE: decode_face_gaze},
            also_which=_companions,
        )
        synchroniser.call_with({FIXATION: self._joints.decode}, self._take_fixation)
        self.subscribe(INTERRUPTED, self._on_interrupted)
        self._delta = self.create_topic_publisher(LM_DELTA)
        self._glance_delta = self.create_topic_publisher(GLANCE_DELTA)
        self._evidence = self.create_topic_publisher(EVIDENCE)
        self._belief = self.create_topic_publisher(BELIEF)
        # Its own generator: a subscriber to the belief changes nothing of what is learned.
        self._belief_random = np.random.default_rng(self._config.seed)
        self.advertise_service(Trigger, 'reset_learning', self._on_reset)
        self.advertise_service(SetBool, 'learning_enabled', self._on_learning_enabled)
        if self._config.realtime_priority:
            self._enable_realtime_scheduling()

    @property
    def track(self) -> str:
        """Return the track of the learner, by what it has used so far."""
        return str(self._learner.track)

    def untrained_learner(self) -> Learner:
        """Make the learner of this node, with its initial weights."""
        kind = self._choice.learner
        return make_learner(kind, self._config.seed, self._learner_configs[kind])

    def _enable_realtime_scheduling(self) -> None:
        granted = str(self._config.realtime_priority)
        try:
            enable_realtime_scheduling(self._config.realtime_priority)
        except OSError as error:
            granted = f'none: {error}'
            self.report_problem('realtime_priority', str(error), Level.WARN)
        self.health.values['real-time priority'] = granted

    def _choose(self, choice: LearnerChoice) -> None:
        if choice != self._choice:
            self._choice = choice
            self._learner.reset()
            self._pipeline.forget()

    def _propose(self, found: StampedSet) -> None:
        header, detections = found.header, self._learner.allowed(found[DETECTIONS])
        # They belong to the set where the detections name them.
        face, gaze = found.values.get(FACE_IMAGE), found.values.get(FACE_GAZE)
        proposal = self._pipeline.process_image(found.posture, detections, face, gaze)
        self._delta.publish(self._joints.encode(header, proposal.delta))
        self._glance_delta.publish(self._joints.encode(header, proposal.glance))
        evidence = {
            'log_evidence': [proposal.log_evidence],
            'expected_gain': [proposal.expected_gain],
        }
        self._evidence.publish(encode_columns(header, evidence))
        self.health.values['log evidence [nats]'] = f'{proposal.log_evidence:.1f}'
        self._learner.report_health()
        if self._belief.get_subscription_count():
            self._publish_belief(header)

    def _publish_belief(self, header: Header) -> None:
        directions = self._pipeline.draw_belief(self._belief_random)
        pan, tilt = directions.T
        weight = np.full(len(directions), 1 / max(len(directions), 1))
        columns = {'pan': pan, 'tilt': tilt, 'weight': weight}
        # Angles of joints are in no frame.
        self._belief.publish(encode_columns(Header(stamp=header.stamp), columns))

    def _take_fixation(self, found: StampedSet) -> None:
        direction = found[FIXATION]
        if direction is None:
            return
        if self._pipeline.process_fixation(found.posture, direction) is not None:
            self._learner.report_health()

    def _on_interrupted(self, message: Header) -> None:
        self._pipeline.interrupt_trial(to_ns(message.stamp))

    def _update(self, trial: Trial, posture: Posture) -> None:
        if self._learning:
            self._on_update(trial, posture.stamp_ns)
            self._learner.update(trial)

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        self._learner.reset()
        self._pipeline.forget()
        response.success, response.message = True, 'everything learned is forgotten'
        return response

    def _on_learning_enabled(self, request: SetBool.Request, response: SetBool.Response) -> Any:
        self._learning = request.data
        response.success = True
        response.message = 'learning' if request.data else 'not learning, still proposing'
        return response

    def destroy_node(self) -> None:
        """Learn and save the trials handed over, then end."""
        self._learner.close()
        super().destroy_node()


def _decode_face(message: Image) -> np.ndarray:
    return checked_face(decode_image(message)[..., 0])


def _companions(detections: list[Detection]) -> list[Topic]:
    """Return the topics that have a message of the same stamp as these detections."""
    face = caregiver_face(detections)
    if face is None or not face.attended:
        return []
    return [FACE_IMAGE, FACE_GAZE] if face.gaze_read else [FACE_IMAGE]


def _share_the_interpreter() -> None:
    """Let the thread that proposes wait only briefly for the one that learns.

    A thread waits for the switch interval before it asks the other one for the interpreter.
    Python's 5 ms is all the time that a proposal has (`./ja bench inference`).
    """
    sys.setswitchinterval(2e-4)


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(LearningModuleNode, args)


if __name__ == '__main__':
    main()
