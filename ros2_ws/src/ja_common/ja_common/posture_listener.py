"""Hears joint_states, and calls back when the posture at an image's stamp is known."""

from collections.abc import Callable

from sensor_msgs.msg import JointState

from ja_common.core.posture import Posture, PostureHistory, PostureJoin
from ja_common.graph_node import GraphNode
from ja_common.joint_codec import JointCodec
from ja_common.time_codec import to_ns
from ja_common.topics import JOINT_STATES

Action = Callable[[Posture], None]


class PostureListener:
    """The posture *at the image's stamp* for a node, never the newest one."""

    def __init__(self, node: GraphNode, joints: JointCodec) -> None:
        self._node = node
        self._joints = joints
        self._history = PostureHistory()
        self._actions: PostureJoin[Action] = PostureJoin(self._history)
        node.subscribe(JOINT_STATES, self._on_joint_states, expected_every_s=2.0)

    @property
    def newest(self) -> Posture | None:
        """The latest measured posture: for holding the head, not for looking at an image."""
        return self._history.newest

    @property
    def is_behind(self) -> bool:
        """Does an image wait for the joint states of its time?"""
        return len(self._actions) > 0

    def when_known(self, stamp_ns: int, action: Action) -> None:
        """Call `action` with the posture at a stamp, now or when the joint states have come.

        When they never come the action is dropped and the node's health says so.
        """
        self._actions.add(stamp_ns, action)
        self._act()

    def _on_joint_states(self, message: JointState) -> None:
        position = self._joints.decode_posture(message)
        if position is None:
            raise ValueError('the message names no joints')
        velocity = self._joints.decode_velocity(message)
        self._history.add(to_ns(message.header.stamp), position, velocity)
        self._act()

    def _act(self) -> None:
        for action, posture in self._actions.ready():
            if posture is None:
                self._node.problem('posture', 'no joint state for the stamp of an image: skipped')
            else:
                action(posture)
