"""The node that calibrates: it takes the gate's place, with its name, parameters and guard."""

import time
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from ja_calibration.core.conductor import Conductor
from ja_calibration.core.course import CourseConfig, course
from ja_common.core.config import parameter
from ja_common.core.posture import Posture
from ja_common.core.stamps import NS_PER_S
from ja_common.graph_node import GraphNode
from ja_common.image_codec import decode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.posture_listener import PostureListener
from ja_common.time_codec import to_ns
from ja_common.topics import IMAGE, JOINT_COMMANDS
from ja_control.command_output import CommandOutput, CommandOutputConfig
from ja_control.core.command_guard import CommandGuard, CommandGuardConfig
from ja_control.core.joint_limits import JointLimitsConfig

_GENTLE_RAD_S2 = 1.5
"""Braked harder, a camera coasts across the play of its gear, and stands on the wrong side."""


@dataclass(frozen=True)
class RigConfig:
    """What is needed beyond the course and the guard."""

    control_rate_hz: float = parameter(
        100.0, 'commands a second, and steps of the motion profile', low=10.0, high=500.0
    )


class CalibrationRig(GraphNode):
    """Leads the head through the course; `conductor.found` is what came of it.

    Its callbacks raise ValueError where the head, or the picture, allows no calibration.
    """

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('gate', **node_kwargs)
        self.conductor: Conductor | None = None
        self.last_hold = ''
        self.image_size = (0, 0)
        self.joints = JointCodec(self.configure(JointConfig))
        self._course = self.configure(CourseConfig)
        self._limits = self.configure(JointLimitsConfig)
        period_s = 1.0 / self.configure(RigConfig).control_rate_hz
        self._guard = CommandGuard(self._limits, self.configure(CommandGuardConfig), period_s)
        self._speed_rad_s = np.nan
        self._velocity = np.zeros(2)
        self._image_ns = 0
        self._joints_ns = 0
        self._postures = PostureListener(self, self.joints)
        self._output = CommandOutput(self, self.configure(CommandOutputConfig))
        self.subscribe(IMAGE, self._on_image, expected_every_s=2.0)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(period_s, self._on_period, clock=steady)

    def stop(self) -> None:
        """From now on brake, and hold."""
        self._guard.enable(False)

    @property
    def at_rest(self) -> bool:
        """Has the last command stopped?"""
        return not np.any(self._velocity)

    def _on_image(self, message: Image) -> None:
        stamp_ns = to_ns(message.header.stamp)
        if stamp_ns <= self._image_ns:
            return
        self._image_ns = stamp_ns
        self._guard.hear_image(time.monotonic(), self._age_s(stamp_ns))
        conductor = self.conductor
        if conductor is None or not conductor.watches:
            return
        grey = cv2.cvtColor(decode_image(message), cv2.COLOR_RGB2GRAY)
        self.image_size = (grey.shape[1], grey.shape[0])

        def see(posture: Posture) -> None:
            conductor.see(grey, stamp_ns, posture.position)

        self._postures.when_known(stamp_ns, see)

    def _on_period(self) -> None:
        now_s, measured = time.monotonic(), self._postures.newest
        if measured is not None:
            self._guard.hear_joints(measured.position, now_s, self._age_s(measured.stamp_ns))
            if self.conductor is not None and measured.stamp_ns != self._joints_ns:
                self._joints_ns = measured.stamp_ns
                self.conductor.hear_joints(measured.stamp_ns, measured.position)
            if self.conductor is None and self._image_ns and self._guard.enabled:
                self.conductor = self._begin(measured)
        if self.conductor is not None:
            self._lead(self.conductor)
        command = self._guard.step(now_s)
        if command.hold is not None:
            self.last_hold = command.hold.text
        self._velocity = command.velocity
        if command.position is not None:
            header = Header(stamp=self.get_clock().now().to_msg())
            posture = self.joints.encode_posture(header, command.position, command.velocity)
            self._output.publish(posture)
        if self.conductor is None or command.position is None:
            return
        if command.hold is not None:
            self.conductor.repeat()
        else:
            self.conductor.step(now_s, command.position, command.velocity)

    def _begin(self, measured: Posture) -> Conductor:
        others = self.count_publishers(self.resolve_topic_name(JOINT_COMMANDS.name)) - 1
        if others > 0:
            raise ValueError(
                f'{others} other node(s) publish {JOINT_COMMANDS.name}: end the gate (./ja rig) '
                'first, two cannot lead one head'
            )
        reach = self._course.amplitude_rad
        ends = measured.position + np.array([[-reach], [reach]])
        if not np.array_equal(self._guard.limits.reachable(ends), ends):
            raise ValueError(
                f'from {measured.position[0]:.3f}, {measured.position[1]:.3f} rad the head cannot '
                f'turn by {reach:g} rad each way within its limits: begin nearer to their middle'
            )
        return Conductor(course(self._course, measured.position))

    def _lead(self, conductor: Conductor) -> None:
        if conductor.speed_rad_s != self._speed_rad_s:
            self._speed_rad_s = conductor.speed_rad_s
            self._guard.set_limits(
                replace(
                    self._limits,
                    max_speed_rad_s=min(self._speed_rad_s, self._limits.max_speed_rad_s),
                    max_acceleration_rad_s2=min(
                        _GENTLE_RAD_S2, self._limits.max_acceleration_rad_s2
                    ),
                )
            )
        if self._guard.engaged:
            self._guard.aim(conductor.aim)

    def _age_s(self, stamp_ns: int) -> float:
        return (self.get_clock().now().nanoseconds - stamp_ns) / NS_PER_S
