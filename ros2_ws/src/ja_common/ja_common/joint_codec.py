"""JointState on the wire: postures, changes of posture, and empty messages (no names)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ja_common.core.config import Configuration, parameter


@dataclass(frozen=True)
class JointConfig(Configuration):
    """How the rig names its two joints, and which of them turn the other way."""

    pan_joint: str = parameter('pan', 'name of the pan joint in joint_states and joint_commands')
    tilt_joint: str = parameter('tilt', 'name of the tilt joint')
    pan_inverted: bool = parameter(False, 'the rig counts pan to the right as positive')
    tilt_inverted: bool = parameter(False, 'the rig counts tilt upward as positive')
    pan_offset_rad: float = parameter(
        0.0, "what the rig's pan joint reads when the head looks ahead", low=-6.3, high=6.3
    )
    tilt_offset_rad: float = parameter(
        0.0, "what the rig's tilt joint reads when the head looks level", low=-6.3, high=6.3
    )


class JointCodec:
    """Between (pan, tilt) in REP-103 axes and JointState in the rig's own names and signs.

    `encode` and `decode` are for changes and directions, `encode_posture` and `decode_posture` for
    measured and commanded joint angles: rig angle = sign * angle + offset.
    """

    def __init__(self, config: JointConfig) -> None:
        self.names = [config.pan_joint, config.tilt_joint]
        self.signs = np.array(
            [-1.0 if config.pan_inverted else 1.0, -1.0 if config.tilt_inverted else 1.0]
        )
        self.offsets = np.array([config.pan_offset_rad, config.tilt_offset_rad])

    def encode(
        self, header: Header, angles: ArrayLike | None, velocity: ArrayLike | None = None
    ) -> JointState:
        """Return a message for angles (2,) [rad], velocity (2,) [rad/s]; empty for angles None."""
        message = JointState(header=header)
        if angles is not None:
            message.name = self.names
            message.position = self._to_rig(angles)
            if velocity is not None:
                message.velocity = self._to_rig(velocity)
        return message

    def decode(self, message: JointState) -> NDArray[np.float64] | None:
        """Return the angles (2,) [rad], or None for an empty message.

        Raises ValueError when a joint is not named, or the numbers are too few or not finite.
        """
        if not message.name:
            return None
        return self._from_rig(message, message.position, 'position')

    def encode_posture(
        self, header: Header, posture: ArrayLike, velocity: ArrayLike | None = None
    ) -> JointState:
        """Return a message for a measured or commanded posture (2,) [rad], [rad/s]."""
        message = self.encode(header, posture, velocity)
        message.position = (np.asarray(message.position) + self.offsets).tolist()
        return message

    def decode_posture(self, message: JointState) -> NDArray[np.float64] | None:
        """Return the measured or commanded posture (2,) [rad]; None and errors as `decode`."""
        angles = self.decode(message)
        return None if angles is None else angles - self.signs * self.offsets

    def decode_velocity(self, message: JointState) -> NDArray[np.float64] | None:
        """Return the velocity (2,) [rad/s], or None where the message gives none.

        joint_state_broadcaster of ros2_control sends NaN where the hardware measures none.
        """
        if np.isnan(message.velocity).all():
            return None
        return self._from_rig(message, message.velocity, 'velocity')

    def _to_rig(self, values: ArrayLike) -> list[float]:
        return (self.signs * np.asarray(values, float)).tolist()

    def _from_rig(self, message: JointState, values: ArrayLike, what: str) -> NDArray[np.float64]:
        names = list(message.name)
        lacking = [name for name in self.names if name not in names]
        if lacking:
            raise ValueError(f'no joint {lacking} in the message; it names {names}')
        values = np.asarray(values, float)
        if len(values) != len(names):
            raise ValueError(f'{len(values)} numbers in {what} for {len(names)} names')
        angles = self.signs * values[[names.index(name) for name in self.names]]
        if not np.isfinite(angles).all():
            raise ValueError(f'{what} of {self.names} is not finite: {angles.tolist()}')
        return angles
