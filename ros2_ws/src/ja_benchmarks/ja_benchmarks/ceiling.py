"""The best possible success: observers that see her gaze, or her head, exactly."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from ja_benchmarks.rows import Row, share_row
from ja_common.core.geometry import (
    angle_between,
    directions_of_vectors,
    vectors_of_directions,
)
from ja_sim.core.gaze import missed_point
from ja_sim.core.objects import Arrangement
from ja_sim.core.scene import Scene, load_scene

# From the base frame to her rest frame, in which x points towards the robot.
_TO_HER_FRAME = np.array([-1.0, -1.0, 1.0])

READER_ERRORS_DEG = {'gaze from landmarks': (2.9, 2.8)}
"""Standard deviations in pan and tilt that are left of a map fitted to one person's readings."""


def ceiling(trials: int = 8000) -> dict[str, Row]:
    """Return the success of observers that know the direction of her eyes, or of her head.

    No observer knows the distance of the attended object. Her eyes miss it by a small angle that
    the scene sets. An observer of the eyes takes the object nearest to the line of gaze; or, as a
    network with one pair of outputs must, it first turns the gaze into the most likely direction.
    An observer of the head takes the object that makes the head's angles most probable; her eyes
    are so small in the picture that they help little.
    """
    rows: dict[str, Row] = {}
    for count in (5, 10):
        scene = load_scene('default')
        scene = dataclasses.replace(scene, objects=dataclasses.replace(scene.objects, count=count))
        # She attends to the first object of each row; the order of drawing has no influence.
        positions = draw_arrangements(scene, trials, np.random.default_rng(0))
        directions = directions_of_vectors(positions)
        looked_at = draw_looked_at(scene, positions[:, 0], np.random.default_rng(1))
        lines = directions_of_vectors(_along_gaze(scene, looked_at))
        off_line = angle_between(lines[:, None], directions[:, :, None]).min(axis=2)
        rows[f'ceiling, {count} objects, nearest to the line of gaze'] = share_row(
            off_line.argmin(axis=1) == 0
        )
        head = draw_heads(scene, looked_at, np.random.default_rng(2))
        rows[f'ceiling, {count} objects, her head alone'] = share_row(
            _likelihood_of_head(scene, head, directions).argmax(axis=1) == 0
        )
        guess = _one_guess(directions_of_vectors(_face(scene) - looked_at), directions[:, 0])
        off_guess = angle_between(guess[:, None], directions)
        rows[f'ceiling, {count} objects, nearest to one guess'] = share_row(
            off_guess.argmin(axis=1) == 0
        )
    return rows


def ceiling_of_senses(trials: int = 4000) -> dict[str, Row]:
    """Return the success of observers that read her gaze with an error, with and without ranges.

    They know the geometry of the scene, the size of the error, and her distance; not how far the
    objects are, or that with the error of a sensor.
    """
    rows: dict[str, Row] = {}
    for count in (5, 10):
        scene = load_scene('default')
        scene = dataclasses.replace(scene, objects=dataclasses.replace(scene.objects, count=count))
        positions = draw_arrangements(scene, trials, np.random.default_rng(0))
        directions, distances = directions_of_vectors(positions), np.linalg.norm(positions, axis=2)
        looked_at = draw_looked_at(scene, positions[:, 0], np.random.default_rng(1))
        gaze = directions_of_vectors((looked_at - _face(scene)) * _TO_HER_FRAME)
        rng = np.random.default_rng(3)
        for reader, error_deg in {'exact gaze': (0.0, 0.0), **READER_ERRORS_DEG}.items():
            read = gaze + np.radians(error_deg) * rng.normal(size=gaze.shape)
            for share in (None, 0.1, 0.03):
                measured = distances * (1 + (share or 0.0) * rng.normal(size=distances.shape))
                likelihood = _likelihood_of_gaze(
                    scene, read, np.radians(error_deg), directions, measured, share
                )
                depth = 'depth unknown' if share is None else f'depth to {100 * share:.0f} %'
                rows[f'ceiling, {count} objects, {reader}, {depth}'] = share_row(
                    likelihood.argmax(axis=1) == 0
                )
    return rows


def _likelihood_of_gaze(
    scene: Scene,
    read: np.ndarray,
    error_rad: np.ndarray,
    directions: np.ndarray,
    measured: np.ndarray,
    share: float | None,
    steps: int = 41,
) -> np.ndarray:
    """Return the likelihood (T, N) of read gazes (T, 2) for objects at directions (T, N, 2).

    `measured` (T, N) [m]: their ranges, with this `share` as error; None: ranges are not known.
    """
    face, likelihood, total = _face(scene), np.zeros(measured.shape), np.zeros(measured.shape)
    deviation = np.hypot(error_rad, np.radians(scene.caregiver.gaze_noise_deg))
    for distance in np.linspace(*scene.objects.distance_m, steps):
        weight = np.ones(measured.shape)
        if share is not None:
            weight = np.exp(-0.5 * ((measured - distance) / (share * distance)) ** 2) / distance
        places = distance * vectors_of_directions(directions)
        off = (read[:, None] - directions_of_vectors((places - face) * _TO_HER_FRAME)) / deviation
        likelihood += weight * np.exp(-0.5 * (off**2).sum(axis=-1))
        total += weight
    # Beyond the limits of the scene a noisy range may leave no weight at all.
    return likelihood / np.maximum(total, 1e-300)


def _face(scene: Scene) -> np.ndarray:
    return np.array([scene.caregiver.distance_m, 0.0, 0.0])


def draw_arrangements(scene: Scene, trials: int, rng: np.random.Generator) -> np.ndarray:
    """Return positions of the objects (T, N, 3) [m] as the world draws them."""
    arrangement = Arrangement(scene.objects, _face(scene), rng)
    places = []
    for _ in range(trials):
        arrangement.rearrange()
        places.append([thing.position for thing in arrangement.objects])
    return np.array(places)


def draw_looked_at(scene: Scene, attended: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return where her eyes point (T, 3) [m] when she attends to objects at (T, 3) [m]."""
    deviation = np.radians(scene.caregiver.gaze_noise_deg)
    eyes = np.broadcast_to(_face(scene), (2, 3))
    return np.array([missed_point(each, eyes, rng.normal(0.0, deviation, 2)) for each in attended])


def draw_heads(scene: Scene, looked_at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return yaw and pitch (T, 2) [rad] of her head when her eyes point at places (T, 3) [m]."""
    spec = scene.caregiver
    taken = rng.uniform(*spec.head_share, len(looked_at))
    error = rng.normal(0.0, np.radians(spec.head_noise_deg), (len(looked_at), 2))
    gaze = directions_of_vectors((looked_at - _face(scene)) * _TO_HER_FRAME)
    return taken[:, None] * gaze + error


def heads_towards(
    scene: Scene, directions: np.ndarray, steps: int
) -> Iterator[tuple[np.ndarray, float]]:
    """Yield where her head points (..., 2) [rad] for objects at (..., 2) [rad], and how surely.

    The second is the standard deviation [rad]. The distance of the object and the head's share of
    the gaze are not known: `steps` values of each, all that the scene allows, are equally likely.
    """
    spec, face = scene.caregiver, _face(scene)
    for distance in np.linspace(*scene.objects.distance_m, steps):
        places = distance * vectors_of_directions(directions)
        gaze = directions_of_vectors((places - face) * _TO_HER_FRAME)
        for share in np.linspace(*spec.head_share, steps):
            deviation = np.radians(np.hypot(spec.head_noise_deg, share * spec.gaze_noise_deg))
            yield share * gaze, float(deviation)


def _one_guess(gaze: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return the mean direction (T, 2) [rad] of the attended object: a cubic fit of the gaze."""
    yaw, pitch = gaze.T
    powers = [yaw**i * pitch**j for i in range(4) for j in range(4 - i)]
    features = np.stack(powers, axis=1)
    return features @ np.linalg.lstsq(features, directions, rcond=None)[0]


def _along_gaze(scene: Scene, attended: np.ndarray, steps: int = 60) -> np.ndarray:
    """Return points (T, steps, 3) [m] of each line of gaze at which the scene allows an object.

    The ends are where the line leaves the shell of allowed distances from the robot.
    """
    face = _face(scene)
    along = attended - face
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    depth = np.linspace(0.0, 2.0 * scene.caregiver.distance_m, 400)[None, :, None]
    points = face + depth * along[:, None]
    low, high = scene.objects.distance_m
    distance = np.linalg.norm(points, axis=2)
    lines = []
    for line, allowed in zip(points, (distance > low) & (distance < high), strict=True):
        first = np.argmax(allowed)  # the near side only: beyond it she would look past the robot
        last = first + np.argmin(np.append(allowed[first:], False))
        lines.append(line[np.linspace(first, last - 1, steps).round().astype(int)])
    return np.array(lines)


def _likelihood_of_head(scene: Scene, head: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return the likelihood (T, N) of her head (T, 2) for each object at directions (T, N, 2)."""
    likelihood = np.zeros(directions.shape[:2])
    for towards, deviation in heads_towards(scene, directions, steps=17):
        off = (head[:, None] - towards) / deviation
        likelihood += np.exp(-0.5 * (off**2).sum(axis=-1)) / deviation**2
    return likelihood
