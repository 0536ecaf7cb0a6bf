"""The calibration node: it replaces the gate and has its name, parameters and guard."""

import time
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from ja_calibration.core.calibration_moves import CalibrationConfig, calibration_moves
from ja_calibration.core.calibration_sequence import CalibrationSequence
from ja_common.camera_input import CameraInput, CameraInputConfig
from ja_common.core.config import Configuration, parameter
from ja_common.core.posture import Posture
from ja_common.core.stamps import NS_PER_S
from ja_common.graph_node import GraphNode
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.synchroniser import StampedSet, Synchroniser
from ja_common.time_codec import to_ns
from ja_common.topics import IMAGE
from ja_control.command_output import CommandOutput, CommandOutputConfig
from ja_control.core.command_guard import CommandGuard, CommandGuardConfig
from ja_control.core.joint_limits import JointLimitsConfig

_GENTLE_ACCELERATION_RAD_S2 = 1.5
"""With harder braking the camera coasts across the backlash and stops on the wrong side."""


@dataclass(frozen=True)
class CalibratorConfig(Configuration):
    """What the node needs beyond the moves and the guard."""

    control_rate_hz: float = parameter(
        100.0, 'commands a second, and steps of the motion profile', low=10.0, high=500.0
    )


class Calibrator(GraphNode):
    """Commands the head through the moves of a calibration; `sequence.result` is its result.

    `refusal` is the error where the head or the images allow no calibration.
    """

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('gate', **node_kwargs)
        self.sequence: CalibrationSequence | None = None
        self.refusal: ValueError | None = None
        self.last_hold = ''
        self.image_size = (0, 0)
        self.joints = JointCodec(self.configure(JointConfig))
        self._camera = CameraInput(
            self.configure(CameraInputConfig), self.resolve_topic_name(IMAGE.name)
        )
        self._config = self.configure(CalibrationConfig)
        self._limits = self.configure(JointLimitsConfig)
        period_s = 1.0 / self.configure(CalibratorConfig).control_rate_hz
        self._guard = CommandGuard(self._limits, self.configure(CommandGuardConfig), period_s)
        self._speed_rad_s = np.nan
        self._velocity = np.zeros(2)
        self._image_ns = 0
        self._joints_ns = 0
        self._synchroniser = Synchroniser(self, self.joints)
        self._synchroniser.call_with({IMAGE: self._decode_new_image}, self._record_image)
        self._output = CommandOutput(self, self.configure(CommandOutputConfig))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(period_s, self._on_period, clock=steady)

    def stop(self) -> None:
        """Brake, and hold the posture from then on."""
        self._guard.enable(False)

    @property
    def at_rest(self) -> bool:
        """Return whether the last command has zero velocity."""
        return not np.any(self._velocity)

    def _decode_new_image(self, message: Image) -> NDArray[np.uint8] | None:
        """Return a grey image that the sequence needs; None where it needs none."""
        stamp_ns = to_ns(message.header.stamp)
        if stamp_ns <= self._image_ns:
            return None
        self._image_ns = stamp_ns
        self._guard.record_image(time.monotonic(), self._age_s(stamp_ns))
        if self.sequence is None or not self.sequence.needs_images:
            return None
        grey = cv2.cvtColor(self._camera.decode(message), cv2.COLOR_RGB2GRAY)
        self.image_size = (grey.shape[1], grey.shape[0])
        return grey

    def _record_image(self, found: StampedSet) -> None:
        grey = found[IMAGE]
        if grey is not None and self.sequence is not None:
            self.sequence.record_image(grey, found.stamp_ns, found.posture.position)

    def _on_period(self) -> None:
        try:
            self._step()
        except ValueError as error:
            self.refusal = error  # the end of the calibration, not only of this call

    def _step(self) -> None:
        now_s, measured = time.monotonic(), self._synchroniser.newest_posture
        if measured is not None:
            self._guard.record_joints(measured.position, now_s, self._age_s(measured.stamp_ns))
            if self.sequence is not None and measured.stamp_ns != self._joints_ns:
                self._joints_ns = measured.stamp_ns
                self.sequence.record_joints(measured.stamp_ns, measured.position)
            if self.sequence is None and self._image_ns and self._guard.enabled:
                self.sequence = self._start(measured)
        if self.sequence is not None:
            self._set_target(self.sequence)
        self._guard.other_commander = self._output.find_other_commander()
        command = self._guard.step(now_s)
        if command.hold is not None:
            self.last_hold = command.hold.text
        self._velocity = command.velocity
        if command.position is not None:
            header = Header(stamp=self.get_clock().now().to_msg())
            posture = self.joints.encode_posture(header, command.position, command.velocity)
            self._output.publish(posture)
        if self.sequence is None or command.position is None:
            return
        if command.hold is not None:
            self.sequence.restart_move()
        else:
            self.sequence.step(now_s, command.position, command.velocity)

    def _start(self, measured: Posture) -> CalibrationSequence:
        if other := self._output.find_other_commander():
            raise ValueError(
                f'{other}: end the gate (./ja rig) first, two nodes cannot command one head'
            )
        reach = self._config.amplitude_rad
        ends = measured.position + np.array([[-reach], [reach]])
        if not np.array_equal(self._guard.limits.reachable(ends), ends):
            raise ValueError(
                f'from {measured.position[0]:.3f}, {measured.position[1]:.3f} rad the head cannot '
                f'turn by {reach:g} rad each way within its limits: start nearer to their middle'
            )
        return CalibrationSequence(calibration_moves(self._config, measured.position))

    def _set_target(self, sequence: CalibrationSequence) -> None:
        if sequence.speed_rad_s != self._speed_rad_s:
            self._speed_rad_s = sequence.speed_rad_s
            self._guard.set_limits(
                replace(
                    self._limits,
                    max_speed_rad_s=min(self._speed_rad_s, self._limits.max_speed_rad_s),
                    max_acceleration_rad_s2=min(
                        _GENTLE_ACCELERATION_RAD_S2, self._limits.max_acceleration_rad_s2
                    ),
                )
            )
        if self._guard.engaged:
            self._guard.set_target(sequence.target)

    def _age_s(self, stamp_ns: int) -> float:
        return (self.get_clock().now().nanoseconds - stamp_ns) / NS_PER_S
