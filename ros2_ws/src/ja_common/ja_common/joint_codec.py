"""JointState on the wire: postures, changes of posture, and empty messages (no names)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ja_common.core.config import ConfigError, Configuration, parameter


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

    def check_together(self) -> None:
        """Raise ConfigError when the two joints are not told apart by their names."""
        if self.pan_joint == self.tilt_joint:
            raise ConfigError(f'pan_joint and tilt_joint are both {self.pan_joint!r}')


class JointCodec:
    """Between (pan, tilt) in REP-103 axes and JointState in the rig's own names and signs.

    `encode` and `decode` are for changes and directions, `encode_posture` and `decode_posture` for
    commanded joint angles: rig angle = sign * angle + offset. `decode_joint` is for joint states,
    which a rig may send for each joint separately, or for a whole robot (`PostureReader`).
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
        # Angles of joints are in no frame: the image's, that they follow from, would mislead.
        message = JointState(header=Header(stamp=header.stamp))
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
        return self._from_rig(message)

    def encode_posture(
        self, header: Header, posture: ArrayLike, velocity: ArrayLike | None = None
    ) -> JointState:
        """Return a message for a measured or commanded posture (2,) [rad], [rad/s]."""
        message = self.encode(header, posture, velocity)
        message.position = (np.asarray(message.position) + self.offsets).tolist()
        return message

    def decode_posture(self, message: JointState) -> NDArray[np.float64] | None:
        """Return the commanded posture (2,) [rad]; None and errors as `decode`."""
        angles = self.decode(message)
        return None if angles is None else angles - self.signs * self.offsets

    def decode_joint(self, message: JointState, joint: int) -> tuple[float, float | None] | None:
        """Return what a message of a whole robot states of one joint, 0 pan or 1 tilt.

        That is its position [rad] and its velocity [rad/s]; None for a message that states no
        position of it. A velocity that is absent or of no use (joint_state_broadcaster sends NaN
        where the hardware measures none) is None. Raises ValueError for a position that is not
        finite, or that cannot be attributed to the joint.
        """
        name, names, positions = self.names[joint], message.name, message.position
        if name not in names or not len(positions):
            return None
        if len(positions) != len(names):
            raise ValueError(
                f'{len(positions)} positions for {len(names)} names: that of {name!r} is unknown'
            )
        index, sign = names.index(name), float(self.signs[joint])
        stated = positions[index]
        if names.count(name) > 1:
            every = [positions[i] for i, other in enumerate(names) if other == name]
            if every.count(stated) != len(every):
                raise ValueError(f'{name!r} is named {len(every)} times, with positions {every}')
        if not math.isfinite(stated):
            raise ValueError(f'the position of {name!r} is not finite: {stated}')
        position = sign * stated - sign * float(self.offsets[joint])
        velocities = message.velocity
        if len(velocities) != len(names) or not math.isfinite(velocities[index]):
            return position, None
        return position, sign * velocities[index]

    def decode_command(self, message: JointState, last: ArrayLike) -> NDArray[np.float64]:
        """Return the posture (2,) [rad] that a command asks for.

        A joint that the command does not state keeps its value of `last` (2,) [rad]. Errors as
        `decode_joint`.
        """
        posture = np.array(last, float)
        for joint in range(len(posture)):
            if (stated := self.decode_joint(message, joint)) is not None:
                posture[joint] = stated[0]
        return posture

    def _to_rig(self, values: ArrayLike) -> list[float]:
        return (self.signs * np.asarray(values, float)).tolist()

    def _from_rig(self, message: JointState) -> NDArray[np.float64]:
        names = list(message.name)
        lacking = [name for name in self.names if name not in names]
        if lacking:
            raise ValueError(f'no joint {lacking} in the message; it names {names}')
        values = np.asarray(message.position, float)
        if len(values) != len(names):
            raise ValueError(f'{len(values)} numbers in position for {len(names)} names')
        angles = self.signs * values[[names.index(name) for name in self.names]]
        if not np.isfinite(angles).all():
            raise ValueError(f'position of {self.names} is not finite: {angles.tolist()}')
        return angles
