"""The caregiver's body in the scene: her appearance, and the posture of head, eyes and lids.

The meshes come from MakeHuman; ``assets/ORIGIN.md`` describes how.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import cv2
import mujoco
import numpy as np

from ja_common.core.config import ConfigError
from ja_common.core.geometry import head_rotation, vectors_of_directions
from ja_sim.core.gaze import GazePose
from ja_sim.core.photo_head_file import PhotoHead, read_photo_head
from ja_sim.core.specs import CaregiverSpec

SKIN_TONES = (
    (0.96, 0.80, 0.70),
    (0.90, 0.72, 0.60),
    (0.80, 0.61, 0.48),
    (0.64, 0.46, 0.35),
    (0.47, 0.33, 0.25),
)
HAIR_COLOURS = ((0.10, 0.09, 0.09), (0.23, 0.17, 0.14), (0.40, 0.31, 0.24), (0.58, 0.56, 0.54))
IRIS_COLOURS = ((0.20, 0.13, 0.09), (0.30, 0.22, 0.14), (0.30, 0.38, 0.40))
SHIRT_COLOURS = ((0.33, 0.36, 0.40), (0.52, 0.52, 0.50), (0.26, 0.26, 0.28), (0.60, 0.57, 0.52))
SIDES = ('left', 'right')
ARM_RADIUS_M, HAND_SIZE_M = 0.035, (0.03, 0.022, 0.045)
SHOULDER = np.array([0.0, 0.17, -0.14])  # of the left arm, in the rest frame [m]
_SKIN_FILE = 'caregiver_skin.png'
_PHOTO_SHIRT = 'chiyo'  # whose shirt a head of a photograph wears: the narrowest
_SHOWN, _HIDDEN = 0, 5  # groups of geoms: MuJoCo draws the first three
_MESH = mujoco.mjtGeom.mjGEOM_MESH
_CAPSULE = mujoco.mjtGeom.mjGEOM_CAPSULE
_SHELL = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
_ELLIPSOID = mujoco.mjtGeom.mjGEOM_ELLIPSOID
# In radii of the eyeball, along the gaze: the discs lie just above the white.
_IRIS = {'pos': (0.86, 0.0, 0.0), 'size': (0.17, 0.46, 0.46)}
_PUPIL = {'pos': (0.95, 0.0, 0.0), 'size': (0.10, 0.20, 0.20)}
_LID = {'pos': (0.0, 0.0, 0.0), 'size': (1.07, 1.07, 1.07)}


@dataclass(frozen=True)
class Appearance:
    """Who she is in one run; colours are RGB in 0..1."""

    identity: str
    skin: tuple[float, float, float]
    hair: tuple[float, float, float]
    iris: tuple[float, float, float]
    shirt: tuple[float, float, float]


def identities() -> list[str]:
    """Return the names of the people in the asset."""
    return [str(name) for name in _asset()['identities']]


def draw_appearance(spec: CaregiverSpec, rng: np.random.Generator) -> Appearance:
    """Draw a person: the one that the specification names, or any."""
    people = identities()
    if spec.identity != 'any' and spec.identity not in people:
        raise ConfigError(
            f"caregiver: no identity '{spec.identity}': choose any or {', '.join(people)}"
        )
    index = int(rng.integers(len(people)))
    skin, hair, iris, shirt = (
        colours[int(rng.integers(len(colours)))]
        for colours in (SKIN_TONES, HAIR_COLOURS, IRIS_COLOURS, SHIRT_COLOURS)
    )
    identity = people[index] if spec.identity == 'any' else spec.identity
    return Appearance(identity, skin, hair, iris, shirt)


@cache
def _asset() -> dict[str, np.ndarray]:
    with (resources.files('ja_sim') / 'assets' / 'caregiver.npz').open('rb') as file:
        return dict(np.load(file))


class CaregiverBodies:
    """Her bodies in the scene; ``eyes`` (2, 3) and ``face`` (3,) are in the rest frame [m]."""

    def __init__(self, spec: mujoco.MjSpec, caregiver: CaregiverSpec) -> None:
        direction = np.radians([caregiver.pan_deg, caregiver.tilt_deg])
        self._face_at = caregiver.distance_m * vectors_of_directions(direction)
        self._facing = head_rotation([direction[0] + np.pi, 0.0])
        self._photo = read_photo_head(Path(caregiver.photo)) if caregiver.photo else None
        _add_skin(spec)
        head = spec.worldbody.add_body(name='caregiver_head', mocap=True)
        torso = spec.worldbody.add_body(name='caregiver_torso', mocap=True)
        if self._photo is None:
            for name in identities():
                _add_person(spec, head, torso, name)
        else:
            _add_photo_head(spec, head, self._photo)
            _add_part(spec, torso, _PHOTO_SHIRT, 'shirt', 'cloth')
        arm = spec.worldbody.add_body(name='caregiver_arm', mocap=True)
        arm.add_geom(name='arm', type=_CAPSULE, size=[ARM_RADIUS_M, 0.3, 0.0], material='cloth')
        arm.add_geom(name='hand', type=_ELLIPSOID, size=HAND_SIZE_M, material='skin')
        for side in SIDES:
            eye = spec.worldbody.add_body(name=f'{side}_eye', mocap=True)
            lid = spec.worldbody.add_body(name=f'{side}_lid', mocap=True)
            for body, part in ((eye, 'white'), (eye, 'iris'), (eye, 'pupil'), (lid, 'lid')):
                # A placeholder size, until a person is drawn.
                body.add_geom(
                    name=f'{side}_{part}',
                    type=_ELLIPSOID,
                    size=[0.01, 0.01, 0.01],
                    material='skin' if part == 'lid' else 'eye',
                )

    @property
    def eyes_turn(self) -> bool:
        """Return whether her eyes turn in her head; those of a photograph do not."""
        return self._photo is None

    def bind_model(self, model: mujoco.MjModel) -> None:
        """Look up the ids of what moves in the compiled model."""
        self._model = model
        names = ['caregiver_torso', 'caregiver_head']
        names += [f'{side}_{part}' for part in ('eye', 'lid') for side in SIDES]
        self._mocap = [model.body(name).mocapid[0] for name in names]
        self._arm_mocap = model.body('caregiver_arm').mocapid[0]
        self._arm, self._hand = model.geom('arm').id, model.geom('hand').id
        self._lids = [model.geom(f'{side}_lid').id for side in SIDES]
        self._eye_parts = [
            model.geom(f'{s}_{p}').id for s in SIDES for p in ('white', 'iris', 'pupil')
        ]
        parts = [model.geom(f'{s}_{p}').id for s in SIDES for p in ('iris', 'pupil')]
        parts += [self._arm, self._hand]
        model.geom_sameframe[parts] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE

    def apply_appearance(self, appearance: Appearance) -> None:
        """Show a person: meshes, eyes and colours; nothing is recompiled.

        A photograph shows its own person instead.
        """
        if self._photo is not None:
            self._apply_photo(self._photo)
            return
        asset, model = _asset(), self._model
        self.eyes = asset[f'{appearance.identity}.eyes'].astype(float)
        self.face = asset[f'{appearance.identity}.face'].astype(float)
        self.origin = self._face_at - self._facing @ self.face
        for name in identities():
            shown = _SHOWN if name == appearance.identity else _HIDDEN
            for part in ('head', 'hair', 'shirt'):
                model.geom_group[model.geom(f'{name}_{part}').id] = shown
        for part in ('hair', 'shirt'):
            model.geom_rgba[model.geom(f'{appearance.identity}_{part}').id, :3] = getattr(
                appearance, part
            )
        model.geom_rgba[model.geom(f'{appearance.identity}_head').id, :3] = appearance.skin
        model.geom_rgba[self._arm, :3], model.geom_rgba[self._hand, :3] = (
            appearance.shirt,
            appearance.skin,
        )
        radius = float(asset[f'{appearance.identity}.eye_radius'])
        for side in SIDES:
            self._apply_eye_appearance(side, radius, appearance)

    def _apply_photo(self, photo: PhotoHead) -> None:
        model = self._model
        self.eyes, self.face = photo.eyes, photo.face
        self.origin = self._face_at - self._facing @ self.face
        model.geom_rgba[model.geom(f'{_PHOTO_SHIRT}_shirt').id, :3] = photo.shirt
        model.geom_rgba[self._arm, :3], model.geom_rgba[self._hand, :3] = photo.shirt, photo.skin
        # The photographed eyes are part of the texture.
        model.geom_group[[*self._eye_parts, *self._lids]] = _HIDDEN

    def _apply_eye_appearance(self, side: str, radius: float, appearance: Appearance) -> None:
        lid_skin = tuple(0.85 * value for value in appearance.skin)
        white = {'pos': (0.0, 0.0, 0.0), 'size': (1.0, 1.0, 1.0)}
        parts: dict[str, tuple[dict[str, Any], tuple[float, ...]]] = {
            'white': (white, (0.86, 0.85, 0.83)),
            'iris': (_IRIS, appearance.iris),
            'pupil': (_PUPIL, (0.03, 0.03, 0.03)),
            'lid': (_LID, lid_skin),
        }
        for part, (shape, colour) in parts.items():
            geom = self._model.geom(f'{side}_{part}').id
            self._model.geom_pos[geom] = radius * np.array(shape['pos'])
            self._model.geom_size[geom] = radius * np.array(shape['size'])
            self._model.geom_rgba[geom, :3] = colour

    def to_rest_frame(self, point: np.ndarray) -> np.ndarray:
        """Return a point (3,) of the base frame in her rest frame [m]."""
        return (point - self.origin) @ self._facing

    def face_position(self, pose: GazePose) -> np.ndarray:
        """Return the centre of her face (3,) [m] in the base frame, in a posture."""
        return self.origin + self._facing @ head_rotation(pose.head) @ self.face

    def place(self, data: mujoco.MjData, pose: GazePose, eyes_closed: bool) -> None:
        """Turn head and eyes, and open or close the lids."""
        head = self._facing @ head_rotation(pose.head)
        eyes = [head @ head_rotation(eye) for eye in pose.eyes]
        rotations = [self._facing, head, *eyes, head, head]
        offsets = [np.zeros(3), np.zeros(3), *self.eyes, *self.eyes]
        for mocap, rotation, offset in zip(self._mocap, rotations, offsets, strict=True):
            data.mocap_pos[mocap] = self.origin + head @ offset
            mujoco.mju_mat2Quat(data.mocap_quat[mocap], rotation.ravel())
        if self._photo is None:
            self._model.geom_group[self._lids] = _SHOWN if eyes_closed else _HIDDEN

    def place_arm(self, data: mujoco.MjData, hand: np.ndarray | None) -> None:
        """Stretch the nearer arm out to a point (3,) [m]; None hides it: both arms hang."""
        model = self._model
        model.geom_group[[self._arm, self._hand]] = _HIDDEN if hand is None else _SHOWN
        if hand is None:
            return
        side = np.copysign(1.0, self.to_rest_frame(hand)[1])
        shoulder = self.origin + self._facing @ (SHOULDER * [1.0, side, 1.0])
        length = float(np.linalg.norm(hand - shoulder))
        data.mocap_pos[self._arm_mocap] = shoulder
        mujoco.mju_quatZ2Vec(data.mocap_quat[self._arm_mocap], (hand - shoulder) / length)
        sleeve = max(length - HAND_SIZE_M[2] - ARM_RADIUS_M, 0.02)
        model.geom_size[self._arm, 1] = model.geom_pos[self._arm, 2] = sleeve / 2.0
        model.geom_pos[self._hand, 2] = length


def _add_skin(spec: mujoco.MjSpec) -> None:
    """Add the painted skin, and materials that take their colour from each geom."""
    picture = resources.files('ja_sim') / 'assets' / _SKIN_FILE
    _add_textured_material(spec, 'skin', picture.read_bytes(), specular=0.08, shininess=0.2)
    spec.add_material(name='skin', specular=0.08, shininess=0.2)
    spec.add_material(name='hair', specular=0.15, shininess=0.3)
    spec.add_material(name='cloth', specular=0.0)
    spec.add_material(name='eye', specular=0.3, shininess=0.8)


def _add_textured_material(
    spec: mujoco.MjSpec, texture: str, png: bytes, specular: float, shininess: float
) -> str:
    """Add a picture as a texture, and a material that shows it; return the material's name."""
    file, material = f'caregiver_{texture}.png', f'painted_{texture}'
    spec.assets = {**spec.assets, file: png}
    spec.add_texture(name=texture, type=mujoco.mjtTexture.mjTEXTURE_2D, file=file)
    layers = [''] * int(mujoco.mjtTextureRole.mjNTEXROLE)
    layers[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = texture
    spec.add_material(name=material, textures=layers, specular=specular, shininess=shininess)
    return material


def _add_person(
    spec: mujoco.MjSpec, head: mujoco.MjsBody, torso: mujoco.MjsBody, name: str
) -> None:
    _add_part(spec, head, name, 'head', 'painted_skin')
    _add_part(spec, head, name, 'hair', 'hair')
    _add_part(spec, torso, name, 'shirt', 'cloth')


def _add_part(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, part: str, material: str
) -> None:
    """Add the head, the hair or the shirt of a person of the asset."""
    asset = _asset()
    faces = asset[f'{name}.hair_faces' if part == 'hair' else f'{part}_faces']
    mesh = _add_mesh(spec, f'{name}_{part}', asset[f'{name}.{part}'], faces)
    if part == 'head':
        mesh.usernormal = asset[f'{name}.normals'].ravel()
        mesh.usertexcoord = asset['head_uv'].ravel()
    _add_mesh_geom(body, mesh.name, material)


def _add_photo_head(spec: mujoco.MjSpec, body: mujoco.MjsBody, photo: PhotoHead) -> None:
    """Add a head with its photograph as the texture."""
    png = cv2.imencode('.png', cv2.cvtColor(photo.texture, cv2.COLOR_RGB2BGR))[1]
    name = _add_textured_material(spec, 'photo', png.tobytes(), specular=0.0, shininess=0.0)
    mesh = _add_mesh(spec, 'photo_head', photo.vertices, photo.faces)
    mesh.usertexcoord = photo.uv.ravel()
    _add_mesh_geom(body, mesh.name, name)


def _add_mesh(
    spec: mujoco.MjSpec, name: str, vertices: np.ndarray, faces: np.ndarray
) -> mujoco.MjsMesh:
    # Open surfaces have no volume to weigh.
    mesh = spec.add_mesh(name=name, inertia=_SHELL)
    mesh.uservert = vertices.ravel()
    mesh.userface = faces.ravel().astype(np.int32)
    return mesh


def _add_mesh_geom(body: mujoco.MjsBody, mesh: str, material: str) -> None:
    body.add_geom(
        name=mesh, type=_MESH, meshname=mesh, material=material, rgba=[1.0, 1.0, 1.0, 1.0]
    )
