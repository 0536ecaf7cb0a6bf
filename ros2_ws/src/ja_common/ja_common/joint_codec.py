"""JointState on the wire: postures, changes of posture, and 'nothing to say' (no names)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ja_common.core.config import parameter


@dataclass(frozen=True)
class JointConfig:
    """How the rig names its two joints, and which of them turn the other way."""

    pan_joint: str = parameter('pan', 'name of the pan joint in joint_states and joint_commands')
    tilt_joint: str = parameter('tilt', 'name of the tilt joint')
    pan_inverted: bool = parameter(False, 'the rig counts pan to the right as positive')
    tilt_inverted: bool = parameter(False, 'the rig counts tilt upward as positive')


class JointCodec:
    """Between (pan, tilt) in REP-103 axes and JointState in the rig's own names and signs."""

    def __init__(self, config: JointConfig) -> None:
        self.names = [config.pan_joint, config.tilt_joint]
        self._signs = np.array(
            [-1.0 if config.pan_inverted else 1.0, -1.0 if config.tilt_inverted else 1.0]
        )

    def encode(
        self, header: Header, angles: ArrayLike | None, velocity: ArrayLike | None = None
    ) -> JointState:
        """Message for angles (2,) [rad] and velocity (2,) [rad/s]; no names when None."""
        message = JointState(header=header)
        if angles is not None:
            message.name = self.names
            message.position = self._to_rig(angles)
            if velocity is not None:
                message.velocity = self._to_rig(velocity)
        return message

    def decode(self, message: JointState) -> NDArray[np.float64] | None:
        """Angles (2,) [rad], or None for an empty message.

        Raises ValueError when a joint is not named, or the numbers are too few or not finite.
        """
        if not message.name:
            return None
        return self._from_rig(message, message.position, 'position')

    def decode_velocity(self, message: JointState) -> NDArray[np.float64] | None:
        """Velocity (2,) [rad/s], or None where the message gives none.

        joint_state_broadcaster of ros2_control sends NaN where the hardware measures none.
        """
        if np.isnan(message.velocity).all():
            return None
        return self._from_rig(message, message.velocity, 'velocity')

    def _to_rig(self, values: ArrayLike) -> list[float]:
        return (self._signs * np.asarray(values, float)).tolist()

    def _from_rig(self, message: JointState, values: ArrayLike, what: str) -> NDArray[np.float64]:
        names = list(message.name)
        lacking = [name for name in self.names if name not in names]
        if lacking:
            raise ValueError(f'no joint {lacking} in the message; it names {names}')
        values = np.asarray(values, float)
        if len(values) != len(names):
            raise ValueError(f'{len(values)} numbers in {what} for {len(names)} names')
        angles = self._signs * values[[names.index(name) for name in self.names]]
        if not np.isfinite(angles).all():
            raise ValueError(f'{what} of {self.names} is not finite: {angles.tolist()}')
        return angles
