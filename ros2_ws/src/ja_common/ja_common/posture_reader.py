"""The posture of the head from the joint states of a whole robot: the one place that joins it."""

import math

from sensor_msgs.msg import JointState

from ja_common.core.health import Level
from ja_common.core.joint_watch import JointWatch
from ja_common.core.posture import PostureHistory
from ja_common.graph_node import GraphNode
from ja_common.joint_codec import JointCodec
from ja_common.time_codec import to_ns
from ja_common.topics import JOINT_STATES

_REPORTED_EVERY_S = 0.5
_PARAMETERS = ('pan_joint', 'tilt_joint')


class PostureReader:
    """Records the two joints of the head, by name, from messages that hold both, one, or neither.

    Each joint has the stamp of the message that states it. `history` has the posture at a stamp.
    """

    def __init__(self, joints: JointCodec, missing_after_s: float | None = 2.0) -> None:
        """`missing_after_s` [s]: a joint that stays away for longer is worth a sentence."""
        self.history = PostureHistory()
        self._joints = joints
        self._reported_s = -math.inf
        self._watch = JointWatch(
            dict(zip(joints.names, _PARAMETERS, strict=True)), missing_after_s
        )

    def record_message(self, message: JointState, now_s: float) -> None:
        """Record what a message states of the two joints; `now_s` is a steady time [s].

        Raises ValueError for a joint whose position cannot be used; the other one is recorded.
        """
        self._watch.record_names(message.name, now_s)
        stamp_ns, wrong = to_ns(message.header.stamp), []
        for joint, name in enumerate(self._joints.names):
            try:
                stated = self._joints.decode_joint(message, joint)
            except ValueError as error:
                wrong.append(str(error))
                self._watch.record_useless(name, 'without a usable position')
                continue
            if stated is None:
                if name in message.name:
                    self._watch.record_useless(name, 'without a position')
                continue
            self.history.record_joint(joint, stamp_ns, *stated)
            self._watch.record_position(name, now_s)
        if wrong:
            raise ValueError('; '.join(wrong))

    def report_joints(self, node: GraphNode, now_s: float) -> None:
        """Report to the health of a node what is wrong with the joints; `now_s` as above [s]."""
        if now_s - self._reported_s < _REPORTED_EVERY_S:
            return
        self._reported_s = now_s
        for where, text in (
            ('missing joint', self.explain_missing()),
            ('joint velocity', self.explain_velocity()),
        ):
            if text:
                node.report_problem(where, text, Level.WARN)
            else:
                node.health.clear_problem(where)

    def explain_missing(self) -> str:
        """Return which joint stays away while messages come; '' while none does."""
        text = self._watch.explain_missing()
        return text and f'{JOINT_STATES.name}: {text}'

    def explain_velocity(self) -> str:
        """Return which joint's velocity is 0 also while it moves; '' for none."""
        pairs = zip(self._joints.names, self.history.ignores_velocity, strict=True)
        ignored = [repr(name) for name, ignores in pairs if ignores]
        if not ignored:
            return ''
        return (
            f'{JOINT_STATES.name}: the velocity of {" and ".join(ignored)} is 0 also while the '
            'joint moves; its speed is derived from its positions instead'
        )

    def explain_unknown(self, stamp_ns: int) -> str:
        """Return why the posture at a stamp is unknown, joint by joint."""
        pairs = zip(self._joints.names, self.history.why_unknown(stamp_ns), strict=True)
        return '; '.join(f'{name!r}: {why}' for name, why in pairs if why)
