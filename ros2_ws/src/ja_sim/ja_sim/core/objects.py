"""Objects on and above the table: their random places and their appearance."""

from __future__ import annotations

import colorsys
import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from ja_common.core.config import ConfigError
from ja_common.core.geometry import vectors_of_directions
from ja_sim.core.specs import ObjectsSpec

SHAPES = ('sphere', 'box', 'cylinder', 'ellipsoid', 'capsule')
PATTERNS = ('plain', 'checker', 'dots', 'cross')
MOTION_RADIUS_M = 0.015
MOTION_RATE_HZ = 0.8
CEILING_HEIGHT_M = 1.5
_ARRANGEMENTS, _PLACES = 20, 400  # tries before an error


@dataclass(frozen=True)
class SceneObject:
    """One object: ``position`` is its centre at rest, (3,) [m] in the base frame."""

    identifier: int
    position: np.ndarray
    radius_m: float
    shape: str
    pattern: str
    colour: tuple[float, float, float]
    quaternion: np.ndarray
    moving: bool
    phase_rad: float

    def position_at(self, time_s: float, shaken: bool = False) -> np.ndarray:
        """Return its centre (3,) [m] at a time; if moving it circles upright, shaken faster."""
        if not (self.moving or shaken):
            return self.position
        angle = 2.0 * math.pi * MOTION_RATE_HZ * (3.0 if shaken else 1.0) * time_s + self.phase_rad
        swing = MOTION_RADIUS_M * np.array([0.0, math.cos(angle), math.sin(angle)])
        return self.position + swing


class Arrangement:
    """Draws objects and keeps them until they are rearranged."""

    def __init__(self, spec: ObjectsSpec, face: np.ndarray, rng: np.random.Generator) -> None:
        """Draw the first arrangement. ``face`` (3,) [m]: no object may hide it."""
        self._spec, self._face, self._rng = spec, face, rng
        self._next_identifier = 0
        self.objects = self._new_objects(self._draw_positions())

    def rearrange(self) -> None:
        """Change what the specification names: nothing, the places, or all objects."""
        if self._spec.rearranged == 'never':
            return
        positions = self._draw_positions()
        if self._spec.rearranged == 'replaced':
            self.objects = self._new_objects(positions)
        else:
            pairs = zip(self.objects, positions, strict=True)
            self.objects = [replace(each, position=position) for each, position in pairs]

    def draw_place(self) -> np.ndarray:
        """Return a random point (3,) [m] of the space that objects may be in."""
        spec, rng = self._spec, self._rng
        direction = np.radians([rng.uniform(*spec.pan_deg), rng.uniform(*spec.tilt_deg)])
        return rng.uniform(*spec.distance_m) * vectors_of_directions(direction)

    def _draw_positions(self) -> list[np.ndarray]:
        """Draw one position after the other, each clear of the face and of those before it."""
        spec = self._spec
        nearest_to_face = math.cos(math.radians(spec.gap_to_face_deg))
        nearest = math.cos(math.radians(spec.gap_deg))
        face = self._face / np.linalg.norm(self._face)
        for _ in range(_ARRANGEMENTS):
            positions: list[np.ndarray] = []
            directions = np.zeros((0, 3))
            for _ in range(_PLACES):
                place = self.draw_place()
                direction = place / math.hypot(*place)
                clear = direction @ face < nearest_to_face
                if clear and (directions @ direction).max(initial=-1.0) < nearest:
                    positions.append(place)
                    directions = np.vstack([directions, direction])
                if len(positions) == spec.count:
                    return positions
        raise ConfigError(
            f'objects: no room for {spec.count} objects {spec.gap_deg:g} deg apart; '
            'widen pan_deg and tilt_deg, or lower count or gap_deg'
        )

    def _new_objects(self, positions: list[np.ndarray]) -> list[SceneObject]:
        spec, rng = self._spec, self._rng
        # Hues all around the circle, so that no two objects of a scene look alike.
        hues = (rng.random() + rng.permutation(spec.count) / spec.count) % 1.0
        objects = []
        for position, hue in zip(positions, hues, strict=True):
            axis = rng.normal(size=4)
            objects.append(
                SceneObject(
                    identifier=self._next_identifier,
                    position=position,
                    radius_m=float(rng.uniform(*spec.radius_m)),
                    shape=str(rng.choice(SHAPES)),
                    pattern=str(rng.choice(PATTERNS)),
                    colour=colorsys.hsv_to_rgb(
                        float(hue), float(rng.uniform(0.8, 1.0)), float(rng.uniform(0.75, 1.0))
                    ),
                    quaternion=axis / np.linalg.norm(axis),
                    moving=bool(rng.random() < spec.moving_share),
                    phase_rad=float(rng.uniform(0.0, 2.0 * math.pi)),
                )
            )
            self._next_identifier += 1
        return objects


_GEOMS = {
    'sphere': (mujoco.mjtGeom.mjGEOM_SPHERE, (1.0, 1.0, 1.0)),
    'box': (mujoco.mjtGeom.mjGEOM_BOX, (0.8, 0.8, 0.8)),
    'cylinder': (mujoco.mjtGeom.mjGEOM_CYLINDER, (0.8, 0.8, 0.8)),
    'ellipsoid': (mujoco.mjtGeom.mjGEOM_ELLIPSOID, (1.3, 0.7, 0.9)),
    'capsule': (mujoco.mjtGeom.mjGEOM_CAPSULE, (0.6, 0.6, 0.6)),
}


class ObjectBodies:
    """The bodies of the objects in the compiled scene; a new appearance recompiles nothing."""

    def __init__(self, spec: mujoco.MjSpec, count: int) -> None:
        for index in range(count):
            body = spec.worldbody.add_body(name=f'object_{index}', mocap=True)
            body.add_geom(name=f'object_{index}', size=[0.03, 0.03, 0.03], material='object_plain')
            body.add_geom(
                name=f'stand_{index}',
                type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                size=[0.003, 0.1, 0.0],
                material='stand',
            )
        self._count = count

    def bind_model(self, model: mujoco.MjModel, table_height_m: float) -> None:
        """Look up the ids of what changes; ``table_height_m`` is where the stands begin."""
        self._model, self._table_height = model, table_height_m
        self._geom = [model.geom(f'object_{i}').id for i in range(self._count)]
        self._stand = [model.geom(f'stand_{i}').id for i in range(self._count)]
        # The compiler found these geoms aligned with their bodies; they no longer need to be.
        model.geom_sameframe[self._geom + self._stand] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
        self._mocap = [model.body(f'object_{i}').mocapid[0] for i in range(self._count)]
        self._material = {p: model.material(f'object_{p}').id for p in PATTERNS}

    def apply_appearance(self, objects: list[SceneObject]) -> None:
        """Give the bodies the shapes, sizes, colours and patterns of these objects."""
        model = self._model
        for each, geom, stand in zip(objects, self._geom, self._stand, strict=True):
            kind, size = _GEOMS[each.shape]
            model.geom_type[geom] = kind
            model.geom_size[geom] = each.radius_m * np.array(size)
            model.geom_rgba[geom] = (*each.colour, 1.0)
            model.geom_matid[geom] = self._material[each.pattern]
            model.geom_quat[geom] = each.quaternion
            # Low objects stand on the table, high ones hang, so that no rod crosses her face.
            height = float(each.position[2])
            end = self._table_height if height < 0.0 else CEILING_HEIGHT_M
            model.geom_size[stand, 1] = abs(end - height) / 2.0
            model.geom_pos[stand, 2] = (end - height) / 2.0

    def place(self, data: mujoco.MjData, positions: np.ndarray) -> None:
        """Put the bodies at positions (N, 3) [m]."""
        data.mocap_pos[self._mocap] = positions
