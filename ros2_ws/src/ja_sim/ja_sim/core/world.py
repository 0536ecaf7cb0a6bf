"""The simulated world as a class: reset, command, step, observe. No ROS.

The robot gets what a rig would provide: pictures and encoder readings. ``truth()`` is for the
scorer alone; a learner must not call it.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from importlib import resources

import mujoco
import numpy as np

from ja_common.core.geometry import (
    angle_between,
    directions_of_vectors,
    finite_pair,
    head_rotation,
    rays_of_directions,
)
from ja_sim.core.behaviour import ROBOT, Blinking, CaregiverBehaviour
from ja_sim.core.camera import Intrinsics, Observation, expose
from ja_sim.core.caregiver import CaregiverBodies, draw_appearance
from ja_sim.core.depth_sensor import DepthSensor
from ja_sim.core.gaze import GazePose, GazeShift, missed_point
from ja_sim.core.head import JointSample, PanTiltHead
from ja_sim.core.light import Lighting
from ja_sim.core.objects import Arrangement, ObjectBodies, SceneObject
from ja_sim.core.render import Renderer, buffer_size
from ja_sim.core.scene import Scene
from ja_sim.core.specs import SensesSpec

START_NS = 1_000_000_000  # a stamp of zero means 'no time' in ROS
_CAMERA, _RIGHT_CAMERA = 'eye', 'right_eye'


@dataclass(frozen=True)
class WorldTruth:
    """The state of the world at one instant, for the scorer only. Positions [m] in the base frame.

    ``attended`` is an index into ``object_ids`` (N,), ``positions`` (N, 3) and ``directions``
    (N, 2) [rad], -1 before the first trial. ``face_direction`` (2,) [rad] is where her face is,
    ``face_position`` (3,) its centre, ``head`` (2,) her head's yaw and pitch (positive to her
    left, and down), ``gaze_target`` (3,) the point she looks at. ``in_view_at_look``: whether the
    robot, when it looked at her and the trial began, had the attended object in view.
    """

    stamp_ns: int
    trial: int
    attended: int
    object_ids: np.ndarray
    positions: np.ndarray
    directions: np.ndarray
    face_direction: np.ndarray
    face_position: np.ndarray
    head: np.ndarray
    gaze_target: np.ndarray
    reliable: bool
    in_view_at_look: bool
    posture: np.ndarray


@dataclass(frozen=True)
class _Exposure:
    """All that one exposure depends on, so that a late picture shows the world of its stamp."""

    truth: WorldTruth
    velocity: np.ndarray
    gaze: GazePose
    eyes_closed: bool
    objects: list[SceneObject]
    hand: np.ndarray | None


class JointAttentionWorld:
    """A camera head, a caregiver and objects. Same seed and same commands, same pictures."""

    def __init__(self, scene: Scene, seed: int, image_size: tuple[int, int] = (320, 240)) -> None:
        """Build the world; ``image_size``: (width, height) [px]. RenderError without OpenGL."""
        self.scene = scene
        self.intrinsics = Intrinsics.from_view(scene.head, image_size)
        self.clamped = False
        self._seed = seed
        self._head = PanTiltHead(scene.head)
        spec = _room(scene)
        self._caregiver = CaregiverBodies(spec, scene.caregiver)
        self._objects = ObjectBodies(spec, scene.objects.count)
        _add_cameras(spec, self.intrinsics, scene.senses)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._caregiver.bind_model(self._model)
        table = self._model.geom('table')
        self._objects.bind_model(self._model, float(table.pos[2] + table.size[2]))
        self._lighting = Lighting(self._model)
        self._camera_mocap = self._model.body('camera').mocapid[0]
        self._renderer: Renderer | None = None
        self.reset()

    @property
    def limits(self) -> np.ndarray:
        """Return the lowest and highest posture, (2, 2) [rad]: one row each for pan and tilt."""
        return self._head.limits

    @property
    def now_ns(self) -> int:
        """Return the simulated time [ns]."""
        return self._now_ns

    def reset(self, seed: int | None = None) -> None:
        """Restart at time zero, with another seed if one is given."""
        self._seed = self._seed if seed is None else seed
        # The first streams stay the same when more are added.
        streams = np.random.SeedSequence(self._seed).spawn(8)
        looks, objects, behaviour, blinks, *senses = map(np.random.default_rng, streams)
        self._encoder_rng, self._image_rng, self._right_image_rng, depth = senses
        self._now_ns = START_NS
        self.clamped = False
        self._head.reset()
        caregiver = self._caregiver
        appearance = draw_appearance(self.scene.caregiver, looks)
        self.person = appearance.identity
        caregiver.apply_appearance(appearance)
        self._lighting.randomise(self.scene.room.light_variation, looks)
        self._gaze = GazeShift(caregiver.eyes, caregiver.to_rest_frame(np.zeros(3)))
        face = caregiver.face_position(self._gaze.pose(0.0))
        self._arrangement = Arrangement(self.scene.objects, face, objects)
        self._behaviour = CaregiverBehaviour(self.scene.caregiver, behaviour)
        self._blinking = Blinking(self.scene.caregiver.blink_rate_hz, blinks)
        self._attended, self._elsewhere, self._in_view = ROBOT, np.zeros(3), False
        self._turned_s = 0.0
        self._frame_buffer: deque[_Exposure] = deque([self._view()])
        self._observation: Observation | None = None
        self._depth_sensor = DepthSensor(self.scene.senses, self.intrinsics, depth)
        self._sample = self._head.read_encoders(self._now_ns, self._encoder_rng)

    def rearrange(self) -> None:
        """Move or replace the objects now, as the scene specifies; she turns to hers."""
        self._arrangement.rearrange()
        self._turn_to_attended()

    def command(self, posture: np.ndarray) -> None:
        """Send the head to a posture (2,) [rad]; ``clamped`` is then True if it was out of limits.

        Raises ValueError, and leaves the head unchanged, if the posture is not two finite numbers.
        """
        self.clamped = self._head.command(finite_pair('a commanded posture', posture))

    def step(self, dt: float) -> None:
        """Advance by ``dt`` [s]: servos, caregiver, objects, and the camera at its own rate."""
        if not (math.isfinite(dt) and dt > 0.0):
            raise ValueError(f'a time step must be a positive number of seconds, not {dt}')
        end_ns = self._now_ns + round(dt * 1e9)
        rate = self.scene.head.camera_rate_hz
        if rate:
            frame = math.floor((self._now_ns - START_NS) * 1e-9 * rate)
            while (exposure_ns := START_NS + round(frame / rate * 1e9)) <= end_ns:
                if exposure_ns > self._now_ns:
                    self._advance_to(exposure_ns)
                    self._frame_buffer.append(self._view())
                frame += 1
        self._advance_to(end_ns)
        if not rate:
            self._frame_buffer.append(self._view())
        seen_ns = end_ns - round(self.scene.head.camera_latency_s * 1e9)
        while len(self._frame_buffer) > 1 and self._frame_buffer[1].truth.stamp_ns <= seen_ns:
            self._frame_buffer.popleft()
        self._sample = self._head.read_encoders(self._now_ns, self._encoder_rng)

    def observe(self) -> Observation:
        """Return the newest picture that has left the camera; its stamp is its exposure's."""
        view = self._frame_buffer[0]
        stamp_ns = view.truth.stamp_ns
        if self._observation is None or self._observation.stamp_ns != stamp_ns:
            image = self._expose(self._draw(view), view, self._image_rng)
            # Of the picture just drawn, so before the second camera's.
            depth = self._measure_depth()
            right = None
            if self.scene.senses.second_camera:
                sharp = self._open_renderer().draw(_RIGHT_CAMERA)
                right = self._expose(sharp, view, self._right_image_rng)
            self._observation = Observation(image, stamp_ns, self.intrinsics, depth, right)
        return self._observation

    def render_picture(
        self,
        head: np.ndarray | None = None,
        eyes_closed: bool | None = None,
        eyes: np.ndarray | None = None,
    ) -> np.ndarray:
        """Render a sharp picture (H, W, 3) of this moment, with her head turned as given.

        ``head`` (2,) [rad] is yaw and pitch, ``eyes`` (2, 2) those of her left and right eye in
        the head; without them her eyes look straight ahead. For experiments; the world does not
        change.
        """
        view = self._view()
        if head is not None:
            turned = np.zeros((2, 2)) if eyes is None else np.asarray(eyes, float)
            view = replace(view, gaze=GazePose(np.asarray(head, float), turned))
        if eyes_closed is not None:
            view = replace(view, eyes_closed=eyes_closed)
        return self._draw(view)

    def joint_state(self) -> JointSample:
        """Return the newest reading of the encoders."""
        return self._sample

    def truth(self) -> WorldTruth:
        """Return the present state of the world; for the scorer only."""
        positions = self._positions()
        response = self._behaviour.response
        face = self._caregiver.face_position(self._gaze.pose(self._time_s, self._target_now()))
        return WorldTruth(
            stamp_ns=self._now_ns,
            trial=response.trial,
            attended=response.attended,
            object_ids=np.array([each.identifier for each in self._arrangement.objects]),
            positions=positions,
            directions=directions_of_vectors(positions),
            face_direction=directions_of_vectors(face),
            face_position=face,
            head=self._gaze.pose(self._time_s).head,
            gaze_target=self._gaze_point(),
            reliable=response.reliable,
            in_view_at_look=self._in_view,
            posture=self._head.posture,
        )

    def truth_at_exposure(self) -> WorldTruth:
        """Return the state at the exposure of the picture of `observe`; for the scorer only."""
        return self._frame_buffer[0].truth

    def close(self) -> None:
        """Free the graphics context."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    @property
    def _time_s(self) -> float:
        return (self._now_ns - START_NS) * 1e-9

    def _advance_to(self, now_ns: int) -> None:
        self._now_ns = now_ns
        self._head.advance_to(self._time_s)
        face = self._caregiver.face_position(self._gaze.pose(self._time_s))
        offset = float(angle_between(self._head.posture, directions_of_vectors(face)))
        speed = float(np.linalg.norm(self._head.velocity))
        count = len(self._arrangement.objects)
        began = self._behaviour.update(self._time_s, offset, speed, count)
        if began:
            self._arrangement.rearrange()
            self._elsewhere = self._arrangement.draw_place()
        attended = self._behaviour.attends_to(self._time_s)
        if began or attended != self._attended:
            self._attended = attended
            self._turn_to_attended()
        if began:
            directions = directions_of_vectors(self._positions())
            self._in_view = self._is_in_view(directions[attended])

    def _turn_to_attended(self) -> None:
        behaviour, spec = self._behaviour, self.scene.caregiver
        share, noise = behaviour.response.head_share, np.array(behaviour.response.head_noise_rad)
        if self._attended == ROBOT:
            share, noise = 1.0, np.zeros(2)
        if not self._caregiver.eyes_turn:
            share = 1.0
        start_s = self._time_s + spec.reaction_s
        self._gaze.start(start_s, spec.turn_s, self._target_now(), share, noise)
        self._turned_s = start_s + spec.turn_s

    def _gaze_point(self) -> np.ndarray:
        """Return the gaze target, (3,) [m]: the robot's camera is the origin."""
        if self._attended == ROBOT:
            return np.zeros(3)
        if not self._behaviour.response.reliable:
            return self._elsewhere
        return self._positions()[self._attended]

    def _target_now(self) -> np.ndarray:
        """Return where her eyes point, (3,) [m] in the rest frame: near the gaze target."""
        target = self._caregiver.to_rest_frame(self._gaze_point())
        if self._attended == ROBOT:
            return target
        return missed_point(
            target, self._caregiver.eyes, np.array(self._behaviour.response.gaze_error_rad)
        )

    def _positions(self) -> np.ndarray:
        """Return where the objects are now, (N, 3) [m]."""
        shaken = self._shown() if self.scene.caregiver.shows_object == 'shakes' else ROBOT
        return np.array(
            [
                each.position_at(self._time_s, shaken=index == shaken)
                for index, each in enumerate(self._arrangement.objects)
            ]
        )

    def _hand(self) -> np.ndarray | None:
        """Return where her hand is, (3,) [m], if she holds an object."""
        held = self._shown()
        if self.scene.caregiver.shows_object != 'holds' or held == ROBOT:
            return None
        return self._positions()[held] - [0.0, 0.0, self._arrangement.objects[held].radius_m]

    def _shown(self) -> int:
        """Return the object to shake or hold: the one she has turned to, or ROBOT."""
        turned = self._time_s >= self._turned_s and self._behaviour.response.reliable
        return self._attended if turned else ROBOT

    def _is_in_view(self, direction: np.ndarray) -> bool:
        view = np.radians([self.scene.head.view_pan_deg, self.scene.head.view_tilt_deg])
        ray = rays_of_directions(self._head.posture, direction)
        return bool(np.all(np.abs(ray) < np.tan(view)))

    def _view(self) -> _Exposure:
        return _Exposure(
            self.truth(),
            self._head.velocity,
            self._gaze.pose(self._time_s, self._target_now()),
            self._blinking.lids_closed(self._time_s),
            self._arrangement.objects,
            self._hand(),
        )

    def _draw(self, view: _Exposure) -> np.ndarray:
        data = self._data
        self._caregiver.place(data, view.gaze, view.eyes_closed)
        self._caregiver.place_arm(data, view.hand)
        self._objects.apply_appearance(view.objects)
        self._objects.place(data, view.truth.positions)
        rotation = head_rotation(view.truth.posture)
        mujoco.mju_mat2Quat(data.mocap_quat[self._camera_mocap], rotation.ravel())
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_camlight(self._model, data)
        return self._open_renderer().draw(_CAMERA)

    def _open_renderer(self) -> Renderer:
        if self._renderer is None:
            size = (self.intrinsics.width, self.intrinsics.height)
            self._renderer = Renderer(self._model, self._data, _CAMERA, size)
        return self._renderer

    def _expose(self, sharp: np.ndarray, view: _Exposure, rng: np.random.Generator) -> np.ndarray:
        return expose(sharp, view.velocity, self.intrinsics, self.scene.head, rng)

    def _measure_depth(self) -> np.ndarray | None:
        """Return the depth (H, W) [m] of the picture just drawn; None where the scene has none."""
        kind = self.scene.senses.depth
        if kind == 'none':
            return None
        exact = self._open_renderer().read_depth()
        return exact if kind == 'exact' else self._depth_sensor.measure(exact)


def _room(scene: Scene) -> mujoco.MjSpec:
    text = (resources.files('ja_sim') / 'assets' / 'room.xml').read_text(encoding='utf-8')
    spec = mujoco.MjSpec.from_string(text)
    if not scene.room.furnished:
        spec.delete(spec.body('furniture'))
    return spec


def _add_cameras(spec: mujoco.MjSpec, intrinsics: Intrinsics, senses: SensesSpec) -> None:
    """Add a camera that looks along x of a body at the origin, with these intrinsics.

    A second camera of the same kind stands to its right, at the baseline that the scene sets.
    """
    size = [intrinsics.width, intrinsics.height]
    body = spec.worldbody.add_body(name='camera', mocap=True)
    places = {_CAMERA: 0.0}
    if senses.second_camera:
        places[_RIGHT_CAMERA] = -senses.baseline_m  # y points to the left
    for name, y in places.items():
        body.add_camera(
            name=name,
            pos=[0.0, y, 0.0],
            quat=[0.5, 0.5, -0.5, -0.5],
            resolution=size,
            sensor_size=size,
            focal_pixel=[intrinsics.fx, intrinsics.fy],
        )
    width, height = buffer_size((intrinsics.width, intrinsics.height))
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
