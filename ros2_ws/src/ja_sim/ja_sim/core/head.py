"""The robot's pan-tilt head: servos, gears and encoders, integrated by MuJoCo.

The head is a model of its own, apart from the scene that the camera sees: servos need steps of a
millisecond, a picture needs none, so that a furnished room costs the physics nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from ja_sim.core.specs import HeadSpec

TIMESTEP_S = 0.001
AXES = {'pan': (0, 0, 1), 'tilt': (0, 1, 0)}
# Inertias add up to 1, so that forces are accelerations [rad/s^2].
ROTOR_INERTIA, LOAD_INERTIA = 0.8, 0.2
# Bearings' dry friction. A load that the gear brakes harder than this coasts across the play.
LOAD_FRICTION_RAD_S2 = 2.0


@dataclass(frozen=True)
class JointSample:
    """One reading of both encoders: position [rad] and velocity [rad/s], each (2,) pan, tilt.

    As on a rig, the stamp is when the driver read; an encoder's delay is not known to it.
    """

    stamp_ns: int
    position: np.ndarray
    velocity: np.ndarray


class PanTiltHead:
    """Two position servos. The camera sits on the load side, the encoders on the rotor side."""

    def __init__(self, spec: HeadSpec) -> None:
        self.spec = spec
        limit = np.radians([spec.pan_limit_deg, spec.tilt_limit_deg])
        self.limits = np.stack([-limit, limit], axis=1)
        self._model = _head_spec(spec).compile()
        self._data = mujoco.MjData(self._model)
        self._load = [self._model.joint(axis).qposadr[0] for axis in AXES]

    def reset(self) -> None:
        """Stand still at the middle of both axes."""
        mujoco.mj_resetData(self._model, self._data)

    def command(self, posture: np.ndarray) -> bool:
        """Set a target posture (2,) [rad]; return True if it had to be clamped to the limits."""
        target = np.clip(posture, self.limits[:, 0], self.limits[:, 1])
        self._data.ctrl[:] = target
        return bool(np.any(target != posture))

    def advance_to(self, time_s: float) -> None:
        """Run the servos until ``time_s`` [s] after the reset, to the nearest millisecond."""
        steps = round((time_s - self._data.time) / TIMESTEP_S)
        if steps > 0:
            mujoco.mj_step(self._model, self._data, steps)
            # A step leaves the sensors at its beginning.
            mujoco.mj_forward(self._model, self._data)

    @property
    def time_s(self) -> float:
        """Return the time since the reset [s]."""
        return float(self._data.time)

    @property
    def posture(self) -> np.ndarray:
        """Return where the camera truly points, (2,) [rad]."""
        return self._data.qpos[self._load].copy()

    @property
    def velocity(self) -> np.ndarray:
        """Return how fast the camera truly turns, (2,) [rad/s]."""
        return self._data.qvel[self._load].copy()

    def read_encoders(self, stamp_ns: int, rng: np.random.Generator) -> JointSample:
        """Return position and velocity as the encoders measure them: delayed, noisy, in steps."""
        position, velocity = self._data.sensordata.reshape(2, 2).T
        noise, step = (
            math.radians(self.spec.encoder_noise_deg),
            math.radians(self.spec.encoder_step_deg),
        )
        if noise:
            position = position + rng.normal(0.0, noise, 2)
        if step:
            position = np.round(position / step) * step
        return JointSample(stamp_ns, position.copy(), velocity.copy())


def _head_spec(spec: HeadSpec) -> mujoco.MjSpec:
    """Build the head: one body chain camera-side, and a rotor for each axis if gears have play."""
    model = mujoco.MjSpec()
    model.option.timestep = TIMESTEP_S
    model.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_GRAVITY
    model.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    play = math.radians(spec.backlash_deg) / 2.0
    load_parent = rotor_parent = model.worldbody
    for name, axis in AXES.items():
        load_parent = _turning_body(load_parent, name, axis, LOAD_INERTIA if play else 1.0)
        driven = model.joint(name)
        if play:
            driven.frictionloss = LOAD_FRICTION_RAD_S2
            _turning_body(rotor_parent, f'{name}_rotor', axis, ROTOR_INERTIA)
            driven = model.joint(f'{name}_rotor')
            gear = model.add_tendon(name=f'{name}_gear', limited=True, range=[-play, play])
            gear.wrap_joint(name, 1.0)
            gear.wrap_joint(driven.name, -1.0)
            gear.solref_limit = [0.004, 1.0]
        _add_servo(model, driven, spec)
    return model


def _turning_body(
    parent: mujoco.MjsBody, name: str, axis: tuple[int, int, int], inertia: float
) -> mujoco.MjsBody:
    body = parent.add_body(name=name, mass=1.0, inertia=[1e-6, 1e-6, 1e-6], explicitinertial=True)
    body.add_joint(name=name, axis=axis, armature=inertia)
    return body


def _add_servo(model: mujoco.MjSpec, joint: mujoco.MjsJoint, spec: HeadSpec) -> None:
    """Add a critically damped position servo on a motor whose torque falls with speed."""
    stiffness, damping = spec.servo_frequency_rad_s**2, 2.0 * spec.servo_frequency_rad_s
    servo = model.add_actuator(
        name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT
    )
    servo.gaintype = mujoco.mjtGain.mjGAIN_FIXED
    servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    servo.gainprm[0] = stiffness
    servo.biasprm[1:3] = -stiffness, -damping
    if spec.acceleration_limit_deg_s2:
        stall = math.radians(spec.acceleration_limit_deg_s2)
        servo.forcelimited, servo.forcerange = True, [-stall, stall]
        if spec.speed_limit_deg_s:
            # A direct-current motor: at its no-load speed nothing is left of the stall torque.
            joint.damping[0] = stall / math.radians(spec.speed_limit_deg_s)
    if spec.dead_time_s:
        servo.delay, servo.nsample = spec.dead_time_s, round(spec.dead_time_s / TIMESTEP_S) + 2
    for kind in (mujoco.mjtSensor.mjSENS_JOINTPOS, mujoco.mjtSensor.mjSENS_JOINTVEL):
        encoder = model.add_sensor(
            type=kind, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint.name
        )
        if spec.encoder_delay_s:
            encoder.delay = spec.encoder_delay_s
            encoder.nsample = round(spec.encoder_delay_s / TIMESTEP_S) + 2
