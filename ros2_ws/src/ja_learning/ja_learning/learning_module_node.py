"""`learning_module`: proposes where to look from the caregiver's face, and learns it online."""

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger

from ja_common.core.config import Configuration, parameter
from ja_common.core.detection import Detection, caregiver_face, objects
from ja_common.core.health import Level
from ja_common.core.posture import STILL_BELOW_RAD_S
from ja_common.detection_codec import decode_detections
from ja_common.graph_node import GraphNode, spin_node
from ja_common.image_codec import decode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.point_cloud_codec import encode_columns
from ja_common.realtime import enable_realtime_scheduling
from ja_common.synchroniser import StampedSet, Synchroniser
from ja_common.topics import (
    BELIEF,
    DETECTIONS,
    EVIDENCE,
    FACE_IMAGE,
    FIXATION,
    GLANCE_DELTA,
    LM_DELTA,
)
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.learner import Learner
from ja_learning.core.learner_registry import LearnerChoice, make_learner
from ja_learning.core.learning_module import LearningModule
from ja_learning.core.look_around import LookAroundConfig
from ja_learning.core.network_config import NetworkConfig
from ja_learning.core.trial import Trial, checked_face
from ja_learning.persistent_learner import PersistentLearner


@dataclass(frozen=True)
class LearningModuleConfig(Configuration):
    """What the node needs beyond the learner itself."""

    seed: int = parameter(0, 'seed of the initial weights', low=0)
    learning_enabled_at_start: bool = parameter(True, 'learn from the start')
    lockstep: bool = parameter(
        False,
        'answer with what was known a trial ago, and wait for that, so that the same seed gives '
        'the same run (else: nobody waits, and what was learned is used as soon as it is there)',
    )
    still_below_rad_s: float = parameter(
        STILL_BELOW_RAD_S, 'a joint slower than this stands still', low=1e-4, high=5.0
    )
    realtime_priority: int = parameter(
        0,
        'answer before all ordinary programs of the machine, in this process and with this '
        'priority (SCHED_RR; lessons excepted); 0: as any program',
        low=0, high=99,
    )  # fmt: skip


class LearningModuleNode(GraphNode):
    """One proposal an image while a trial is under way; one lesson a fixation.

    Lessons are learned in a thread of their own (`PersistentLearner`): no proposal waits for them.
    """

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('learning_module', **node_kwargs)
        self._config = self.configure(LearningModuleConfig)
        self._choice = self.configure(LearnerChoice, self._choose)
        self._network_config = self.configure(NetworkConfig)
        self._gaze_line_config = self.configure(GazeLineConfig)
        self._joints = JointCodec(self.configure(JointConfig))
        self._learning = self._config.learning_enabled_at_start
        _share_the_interpreter()
        self._learner = PersistentLearner(self, self.untrained, self._config.lockstep)
        self._module = LearningModule(
            lambda: self._learner.predictor,
            self.configure(LookAroundConfig),
            self._config.still_below_rad_s,
            self._config.seed,
        )
        synchroniser = Synchroniser(self, self._joints)
        # First the proposal for an image, then its lesson, and only then the next proposal.
        synchroniser.call_with(
            {DETECTIONS: decode_detections},
            self._propose,
            also={FACE_IMAGE: _decode_face},
            also_when=_shows_attended_face,
        )
        synchroniser.call_with({FIXATION: self._joints.decode}, self._learn)
        self._delta = self.create_topic_publisher(LM_DELTA)
        self._glance_delta = self.create_topic_publisher(GLANCE_DELTA)
        self._evidence = self.create_topic_publisher(EVIDENCE)
        self._belief = self.create_topic_publisher(BELIEF)
        # Its own generator: whether somebody looks changes nothing of what is learned.
        self._belief_random = np.random.default_rng(self._config.seed)
        self.advertise_service(Trigger, 'reset_learning', self._on_reset)
        self.advertise_service(SetBool, 'learning_enabled', self._on_learning_enabled)
        if self._config.realtime_priority:
            self._answer_before_all_else()

    def untrained(self) -> Learner:
        """The learner that this node teaches, before its first lesson."""
        return make_learner(
            self._choice, self._network_config, self._gaze_line_config, self._config.seed
        )

    def _answer_before_all_else(self) -> None:
        said = str(self._config.realtime_priority)
        try:
            enable_realtime_scheduling(self._config.realtime_priority)
        except OSError as error:
            said = f'none: {error}'
            self.problem('realtime_priority', str(error), Level.WARN)
        self.health.values['real-time priority'] = said

    def _choose(self, choice: LearnerChoice) -> None:
        if choice != self._choice:
            self._choice = choice
            self._learner.begin_anew()
            self._module.forget()

    def _propose(self, found: StampedSet) -> None:
        header, detections = found.header, found[DETECTIONS]
        rays = np.array([seen.ray for seen in objects(detections)]).reshape(-1, 2)
        face = caregiver_face(detections)
        attended = (found[FACE_IMAGE], face.ray) if face is not None and face.attended else None
        proposal = self._module.see(found.posture, rays, attended)
        if proposal.given_up is not None and self._learning:
            self._learner.learn(proposal.given_up)
        self._delta.publish(self._joints.encode(header, proposal.delta))
        self._glance_delta.publish(self._joints.encode(header, proposal.glance))
        evidence = {'log_evidence': [proposal.log_evidence]}
        self._evidence.publish(encode_columns(header, evidence))
        self.health.values['log evidence [nats]'] = f'{proposal.log_evidence:.1f}'
        self._learner.tell()
        if self._belief.get_subscription_count():
            self._tell_belief(header)

    def _tell_belief(self, header: Header) -> None:
        directions = self._module.believed(self._belief_random)
        pan, tilt = directions.T
        weight = np.full(len(directions), 1 / max(len(directions), 1))
        columns = {'pan': pan, 'tilt': tilt, 'weight': weight}
        self._belief.publish(encode_columns(header, columns))

    def _learn(self, found: StampedSet) -> None:
        direction = found[FIXATION]
        if direction is None:
            return
        trial = self._module.fixate(found.posture, direction)
        if trial is not None and self._learning:
            self.teach(trial, found.stamp_ns)

    def teach(self, trial: Trial, stamp_ns: int) -> None:
        """Learn from a trial that ended in a fixation on the image of this stamp."""
        self._learner.learn(trial)
        self._learner.tell()

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        self._learner.begin_anew()
        self._module.forget()
        response.success, response.message = True, 'everything learned is forgotten'
        return response

    def _on_learning_enabled(self, request: SetBool.Request, response: SetBool.Response) -> Any:
        self._learning = request.data
        response.success = True
        response.message = 'learning' if request.data else 'not learning, still proposing'
        return response

    def destroy_node(self) -> None:
        """What was lived is learned and saved before the end."""
        self._learner.close()
        super().destroy_node()


def _decode_face(message: Image) -> np.ndarray:
    return checked_face(decode_image(message)[..., 0])


def _shows_attended_face(detections: list[Detection]) -> bool:
    face = caregiver_face(detections)
    return face is not None and face.attended


def _share_the_interpreter() -> None:
    """Let the thread that proposes not wait long for the one that learns.

    So long does the one wait before it asks the other for the interpreter; Python's 5 ms is all
    the time that a proposal has (`./ja bench inference`).
    """
    sys.setswitchinterval(2e-4)


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(LearningModuleNode, args)


if __name__ == '__main__':
    main()
