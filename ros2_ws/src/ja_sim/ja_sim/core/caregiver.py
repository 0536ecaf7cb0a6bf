"""The caregiver's body in the scene: a head and two eyes that turn, on a torso that sits."""

from __future__ import annotations

import mujoco
import numpy as np

from ja_common.core.geometry import head_rotation, vectors_of_directions

from .gaze import GazePose
from .scene import CaregiverSpec

_BALL = mujoco.mjtGeom.mjGEOM_ELLIPSOID
_NECK_TO_FACE = np.array([0.10, 0.0, 0.12])


class CaregiverBodies:
    """Bodies of the caregiver; ``eyes`` (2, 3) and ``face`` (3,) are in her rest frame [m]."""

    def __init__(self, spec: mujoco.MjSpec, caregiver: CaregiverSpec) -> None:
        direction = np.radians([caregiver.pan_deg, caregiver.tilt_deg])
        self._facing = head_rotation([direction[0] + np.pi, 0.0])
        face = caregiver.distance_m * vectors_of_directions(direction)
        self.face = _NECK_TO_FACE
        self.origin = face - self._facing @ self.face
        self.eyes = np.array([[0.075, 0.032, 0.135], [0.075, -0.032, 0.135]])
        skin, dark = [0.85, 0.66, 0.56, 1.0], [0.2, 0.15, 0.13, 1.0]
        head = spec.worldbody.add_body(name='caregiver_head', mocap=True)
        head.add_geom(type=_BALL, pos=[0, 0, 0.12], size=[0.095, 0.075, 0.12], rgba=skin)
        head.add_geom(type=_BALL, pos=[-0.02, 0, 0.15], size=[0.1, 0.08, 0.11], rgba=dark)
        head.add_geom(type=_BALL, pos=[0.095, 0, 0.10], size=[0.02, 0.014, 0.025], rgba=skin)
        head.add_geom(
            type=_BALL, pos=[0.082, 0, 0.06], size=[0.01, 0.025, 0.007], rgba=[0.7, 0.4, 0.4, 1]
        )
        for side in (1, -1):
            head.add_geom(
                type=_BALL, pos=[0.083, side * 0.032, 0.16], size=[0.006, 0.02, 0.004], rgba=dark
            )
        for name in ('left_eye', 'right_eye'):
            eye = spec.worldbody.add_body(name=f'caregiver_{name}', mocap=True)
            eye.add_geom(type=_BALL, size=[0.015, 0.015, 0.011], rgba=[0.9, 0.9, 0.88, 1])
            eye.add_geom(type=_BALL, pos=[0.012, 0, 0], size=[0.004, 0.007, 0.007], rgba=dark)
        torso = spec.worldbody.add_body(name='caregiver_torso', pos=self.origin)
        torso.add_geom(
            type=_BALL, pos=[0.03, 0, -0.35], size=[0.13, 0.22, 0.33], rgba=[0.35, 0.37, 0.40, 1]
        )
        torso.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            pos=[0.02, 0, -0.02],
            size=[0.05, 0.06, 0],
            rgba=skin,
        )

    def bind(self, model: mujoco.MjModel) -> None:
        """Look up what moves."""
        names = ('caregiver_head', 'caregiver_left_eye', 'caregiver_right_eye')
        self._mocap = [model.body(name).mocapid[0] for name in names]

    def to_rest_frame(self, point: np.ndarray) -> np.ndarray:
        """A point (3,) of the base frame in her rest frame [m]."""
        return (point - self.origin) @ self._facing

    def face_position(self, pose: GazePose) -> np.ndarray:
        """Centre of her face (3,) [m] in the base frame, in a posture."""
        return self.origin + self._facing @ head_rotation(pose.head) @ self.face

    def place(self, data: mujoco.MjData, pose: GazePose) -> None:
        """Turn head and eyes."""
        head = self._facing @ head_rotation(pose.head)
        turned = [head] + [head @ head_rotation(eye) for eye in pose.eyes]
        offsets = [np.zeros(3), *self.eyes]
        for mocap, rotation, offset in zip(self._mocap, turned, offsets, strict=True):
            data.mocap_pos[mocap] = self.origin + head @ offset
            mujoco.mju_mat2Quat(data.mocap_quat[mocap], rotation.ravel())
