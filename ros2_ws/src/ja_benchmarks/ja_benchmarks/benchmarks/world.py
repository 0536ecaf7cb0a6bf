"""The speed and the realism of the simulated world: pictures a second, faces, the ceiling.

Rows are ``{'value', 'unit', 'n', 'interval'}`` with a 95 % interval.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterator
from functools import cache, partial

import cv2
import numpy as np

from ja_benchmarks.ceiling import ceiling
from ja_benchmarks.centerface import CenterFace
from ja_benchmarks.rows import Row, mean_row, share_row
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.box import Box
from ja_perception.core.face_crop import crop_face
from ja_perception.core.haar import read_cascade
from ja_sim.core.caregiver import identities
from ja_sim.core.scene import Scene, load_scene
from ja_sim.core.specs import HEAD_PRESETS, SensesSpec
from ja_sim.core.world import JointAttentionWorld

SIZES = ((160, 120), (320, 240), (640, 480))
TURNS_DEG = (0, 20, 40, 60)
SENSES = {
    'none': SensesSpec(),
    'exact depth': SensesSpec(depth='exact'),
    'depth of a sensor': SensesSpec(depth='sensor'),
    'second camera': SensesSpec(second_camera=True),
}
PENALTIES = (0.1, 0.3, 1.0, 3.0, 10.0)


def run() -> dict[str, Row]:
    """Measure all figures of the world."""
    return speed() | senses() | detection() | head_pose() | ceiling()


def speed(pictures: int = 200) -> dict[str, Row]:
    """Measure pictures a second of the furnished room, and the time of 0.1 s of physics."""
    rows = {}
    for size in SIZES:
        world = JointAttentionWorld(load_scene('default'), seed=0, image_size=size)
        times = _times(world.render_picture, pictures)
        rows[f'pictures at {size[0]}x{size[1]}'] = _rate(times, '1/s')
        world.close()
    for preset in HEAD_PRESETS:
        world = JointAttentionWorld(_on_head(preset), seed=0)
        times = _times(partial(world.step, 0.1), pictures)
        rows[f'step of 0.1 s, {preset}'] = mean_row(1e3 * times, 'ms')
        world.close()
    return rows


def senses(pictures: int = 200) -> dict[str, Row]:
    """Measure the processor time that depth and a second camera add to a picture."""
    rows = {}
    for size in SIZES[1:]:
        worlds = {
            name: JointAttentionWorld(_with_senses(spec), seed=0, image_size=size)
            for name, spec in SENSES.items()
        }
        times: dict[str, list[float]] = {name: [] for name in worlds}
        for _ in range(pictures + 1):
            for name, world in worlds.items():
                world.step(0.02)
                began_s = time.process_time()
                world.observe()
                times[name].append(time.process_time() - began_s)
        for name, world in worlds.items():
            world.close()
            if name != 'none':
                # The first picture opens the renderer.
                added = np.subtract(times[name], times['none'])[1:]
                rows[f'{name}, added at {size[0]}x{size[1]}'] = mean_row(1e3 * added, 'ms')
    return rows


def detection(seeds: int = 2) -> dict[str, Row]:
    """Measure the share of turned faces that each detector finds, over people, lights, sides."""
    rows = {}
    for size in SIZES[:2]:
        for name, find in DETECTORS.items():
            for turn in TURNS_DEG:
                found = [
                    _is_face(find(picture), picture)
                    for picture in _turned_faces(size, turn, seeds)
                ]
                rows[f'{name} at {turn} deg, {size[0]}x{size[1]}'] = share_row(found)
    return rows


def head_pose(looks_per_person: int = 250) -> dict[str, Row]:
    """Measure the error of a linear ridge from 30x25 crops to her head's yaw and pitch.

    Every fifth look is for the test: with one ridge for all people, and with a ridge for each
    person. The hardest split tests on people that no ridge was fitted to.
    """
    crops, angles, people = _pool(looks_per_person)
    fresh = np.arange(len(crops)) % 5 == 0
    own = np.concatenate(
        [
            _ridge_errors(crops[people == p], angles[people == p], fresh[people == p])
            for p in np.unique(people)
        ]
    )
    errors = {
        'fresh looks, one person': own,
        'fresh looks, all people': _ridge_errors(crops, angles, fresh),
        'unseen people': _ridge_errors(crops, angles, people >= people.max() - 1),
    }
    return {
        f'head {axis} from 30x25, {split}': mean_row(error[:, i], 'deg')
        for split, error in errors.items()
        for i, axis in enumerate(('yaw', 'pitch'))
    }


def looks(world: JointAttentionWorld, count: int) -> Iterator[np.ndarray]:
    """Look at her repeatedly; yield a picture of each gaze once she has turned."""
    spec = world.scene.caregiver
    straight, away = np.radians([spec.pan_deg, spec.tilt_deg]), np.radians([30.0, 10.0])
    turned_s = spec.reaction_s + spec.turn_s + 0.05
    for _ in range(count):
        trial = world.truth().trial
        world.command(away)
        world.step(0.2)
        world.command(straight)
        while world.truth().trial == trial:
            world.step(0.05)
        world.step(turned_s)
        yield world.observe().image


def _pool(looks_per_person: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return crops (N, 750) in 0..1, yaw and pitch (N, 2) [deg], number of the person (N,)."""
    crops, angles, people = [], [], []
    for person, name in enumerate(identities()):
        world = JointAttentionWorld(_of_person(name), seed=person)
        for image in looks(world, looks_per_person):
            boxes = blazeface(image)
            if boxes:
                crops.append(crop_face(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), boxes[0]).ravel())
                angles.append(np.degrees(world.truth().head))
                people.append(person)
        world.close()
    return np.array(crops) / 255.0, np.array(angles), np.array(people)


def _ridge_errors(crops: np.ndarray, angles: np.ndarray, test: np.ndarray) -> np.ndarray:
    """Return absolute errors (N, 2) [deg]; the penalty is chosen within the training looks."""
    train, truth = crops[~test], angles[~test]
    held_out = np.arange(len(train)) % 5 == 0
    penalty = min(
        PENALTIES,
        key=lambda each: np.abs(
            _ridge(train[~held_out], truth[~held_out], train[held_out], each) - truth[held_out]
        ).mean(),
    )
    return np.abs(_ridge(train, truth, crops[test], penalty) - angles[test])


def _ridge(x: np.ndarray, y: np.ndarray, fresh: np.ndarray, penalty: float) -> np.ndarray:
    mean, target = x.mean(axis=0), y.mean(axis=0)
    centred = x - mean
    gram = centred.T @ centred + penalty * np.eye(x.shape[1])
    return (fresh - mean) @ np.linalg.solve(gram, centred.T @ (y - target)) + target


def blazeface(image: np.ndarray) -> list[Box]:
    """Return faces that BlazeFace short range finds in the whole picture, best first."""
    height, width = image.shape[:2]
    square = Box((width - 1) / 2.0, (height - 1) / 2.0, width, width)
    return [face.box for face in _blazeface().find_faces(image, square)]


def haar(image: np.ndarray) -> list[Box]:
    """Return faces that the Haar cascades find: frontal, then both profiles."""
    grey = cv2.equalizeHist(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
    # Their smallest window is 20 px.
    scale = 360.0 / grey.shape[0]
    grey = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    frontal, profile = _cascades()
    views = ((frontal, grey, False), (profile, grey, False), (profile, grey[:, ::-1].copy(), True))
    boxes = []
    for cascade, view, mirrored in views:
        for x, y, w, h in cascade.detectMultiScale(view, 1.1, 4, minSize=(60, 60)):
            u = x + w / 2.0
            u = view.shape[1] - u if mirrored else u
            boxes.append(Box(u / scale, (y + h / 2.0) / scale, w / scale, h / scale))
    return boxes


def centerface(image: np.ndarray) -> list[Box]:
    """Return faces that CenterFace finds."""
    return _centerface().find(image)


DETECTORS: dict[str, Callable[[np.ndarray], list[Box]]] = {
    'BlazeFace': blazeface,
    'CenterFace': centerface,
    'Haar': haar,
}


@cache
def _blazeface() -> BlazeFace:
    return BlazeFace()


@cache
def _centerface() -> CenterFace:
    return CenterFace()


@cache
def _cascades() -> tuple[cv2.CascadeClassifier, cv2.CascadeClassifier]:
    return read_cascade('frontalface_alt2'), read_cascade('profileface')


def _turned_faces(size: tuple[int, int], turn_deg: float, seeds: int) -> Iterator[np.ndarray]:
    for name in identities():
        world = JointAttentionWorld(_of_person(name), seed=0, image_size=size)
        for seed in range(seeds):
            world.reset(seed)
            for side in (1, -1):
                yield world.render_picture(
                    head=np.radians([side * turn_deg, 5.0]), eyes_closed=False
                )
        world.close()


def _is_face(boxes: list[Box], picture: np.ndarray) -> bool:
    """Return True if any box is where her face is, in the middle of the picture."""
    height, width = picture.shape[:2]
    return any(
        abs(box.u - width / 2.0) < width / 8.0
        and abs(box.v - height / 2.0) < height / 6.0
        and height / 8.0 < box.width < height / 1.5
        for box in boxes
    )


def _of_person(name: str) -> Scene:
    scene = load_scene('default')
    return dataclasses.replace(
        scene, caregiver=dataclasses.replace(scene.caregiver, identity=name)
    )


def _with_senses(spec: SensesSpec) -> Scene:
    return dataclasses.replace(load_scene('default'), senses=spec)


def _on_head(preset: str) -> Scene:
    return dataclasses.replace(load_scene('default'), name=preset, head=HEAD_PRESETS[preset])


def _times(call: Callable[[], object], count: int) -> np.ndarray:
    """Measure the processor time [s] of each call, after one that does not count.

    The times of all threads are added, so that a rate is that of one core.
    """
    call()
    stamps = [time.process_time()]
    for _ in range(count):
        call()
        stamps.append(time.process_time())
    return np.diff(stamps)


def _rate(times: np.ndarray, unit: str) -> Row:
    row = mean_row(times, unit)
    assert row['interval'] is not None
    low, high = row['interval']
    return {**row, 'value': 1.0 / row['value'], 'interval': [1.0 / high, 1.0 / low]}
