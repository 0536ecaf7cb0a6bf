"""Commands in the message of the rig: JointState, JointTrajectory or Float64MultiArray."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from builtin_interfaces.msg import Duration
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ja_common.core.config import Configuration, parameter
from ja_common.core.stamps import NS_PER_S
from ja_common.graph_node import GraphNode
from ja_common.topics import FORWARD_COMMANDS, JOINT_COMMANDS, JOINT_TRAJECTORY


@dataclass(frozen=True)
class CommandOutputConfig(Configuration):
    """The message for the controller of the rig; `joint_commands` is always published."""

    output: str = parameter(
        'joint_state', 'message for the controller of the rig',
        choices=('joint_state', 'joint_trajectory', 'float64_multi_array'),
    )  # fmt: skip
    joint_order: str = parameter(
        'pan_tilt', 'order of the numbers of float64_multi_array', choices=('pan_tilt', 'tilt_pan')
    )
    time_from_start_s: float = parameter(
        0.05,
        'time in which the head shall reach the point of joint_trajectory',
        low=0.001,
        high=5.0,
    )


class CommandOutput:
    """Publishes each command on `joint_commands`, and in the message of the rig's controller.

    JointTrajectory: a single point with a zero stamp, which means 'now': the clocks of the two
    machines do not matter. Float64MultiArray: the numbers in the order of the controller's
    `joints`.
    """

    def __init__(self, node: GraphNode, config: CommandOutputConfig) -> None:
        self._node = node
        self._config = config
        self._joint_commands = node.create_topic_publisher(JOINT_COMMANDS)
        topic = {'joint_trajectory': JOINT_TRAJECTORY, 'float64_multi_array': FORWARD_COMMANDS}
        self._controller = (
            node.create_topic_publisher(topic[config.output]) if config.output in topic else None
        )
        publishers = (self._joint_commands, self._controller)
        self._topics = [each.topic_name for each in publishers if each is not None]

    def publish(self, command: JointState) -> None:
        """Publish a command: names, position [rad], velocity [rad/s], in the rig's signs."""
        self._joint_commands.publish(command)
        if self._controller is not None:
            self._controller.publish(self._for_controller(command))

    def find_other_commander(self) -> str:
        """Return a sentence with the other nodes that publish on a topic of these commands, or ''.

        Takes some microseconds while there are none: call it before every command.
        """
        for topic in self._topics:
            # Endpoints are counted, not names: a second gate has the name of this one. Our own is
            # in the count from the moment it is made.
            if self._node.count_publishers(topic) > self._topics.count(topic):
                return f'{topic} is published by {self._other_publishers(topic)} as well'
        return ''

    def _other_publishers(self, topic: str) -> str:
        names = sorted(
            f'{publisher.node_namespace.rstrip("/")}/{publisher.node_name}'
            for publisher in self._node.get_publishers_info_by_topic(topic)
        )
        own = self._node.get_fully_qualified_name()
        if own in names:
            names.remove(own)
        return (
            ', '.join(f'another {name}' if name == own else name for name in names)
            or 'an unknown node'
        )

    def _for_controller(self, command: JointState) -> Any:
        if self._config.output == 'float64_multi_array':
            step = 1 if self._config.joint_order == 'pan_tilt' else -1
            return Float64MultiArray(data=list(command.position)[::step])
        fraction, whole = math.modf(self._config.time_from_start_s)
        start = Duration(sec=int(whole), nanosec=round(fraction * NS_PER_S))
        # Without velocities: when the next point is lost, the head comes to rest at this one.
        point = JointTrajectoryPoint(
            positions=np.asarray(command.position).tolist(), time_from_start=start
        )
        return JointTrajectory(header=Header(), joint_names=list(command.name), points=[point])
