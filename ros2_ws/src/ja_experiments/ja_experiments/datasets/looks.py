"""Looks at the caregiver: the data sets of section 3.1, rendered once and cached.

The robot looks at the caregiver of the rendered world, waits for her gaze, looks aside, and looks
again. The picture of her face comes from the detector and the crop of the live graph. The
direction of the attended object is the truth of the world. The experiment places the object there;
the learner never receives it.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import shutil
import time
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, replace
from importlib import metadata, resources
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.cache import cache_folder
from ja_common.core.config import ConfigError
from ja_common.core.detection import caregiver_face, objects
from ja_common.core.files import why_not_written
from ja_common.core.geometry import angle_between, directions_of_rays
from ja_common.core.safe_files import load_json, read_bytes
from ja_control.core.attention_cycle import Phase
from ja_experiments.agents.robot import FixedTurn, Robot
from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.rendered import DWELL_S, RenderedStep, RenderedTask
from ja_learning.core.trial import SAME_OBJECT_RAD
from ja_perception.core.gaze_reader import GazeReader
from ja_sim.core.scene import Scene, load_scene
from ja_sim.core.world import JointAttentionWorld

POOL = 125
"""Number of data sets that the paper learns from."""
FRESH = 1000
"""Number of further looks at the same person, for tests."""
IMAGE_SIZE = (320, 240)
_LARGEST_BYTES = 2**26
_ASIDE_RAD = (0.35, 0.0)
_MADE_BY = ('ja_common', 'ja_perception', 'ja_control', 'ja_sim')
_LIBRARIES = ('mujoco', 'numpy')
_FILES = ('.py', '.npz', '.png', '.xml', '.yaml', '.onnx')
_WEIGHTS, _FACE_DETECTOR = '.onnx', 'blazeface_short_range.onnx'
"""Of the weights, looks without senses depend on the face detector's, and open no other."""


def _unknown() -> NDArray[np.float64]:
    return np.empty(0)


_SENSES: dict[str, tuple[int, ...]] = {
    'gazes': (9,),
    'face_ranges': (2,),
    'object_ranges': (2,),
    'face_distances': (),
    'object_distances': (),
}
"""Columns of what the looks of a robot with more senses hold beside the pictures."""


@dataclass(frozen=True)
class Looks:
    """Pictures of the caregiver's face, and directions of the object that she looked at.

    `faces`: uint8 (n, 30, 25), seen in the directions `faces_at`, (n, 2) [rad]. `postures`: (n, 2)
    [rad], of the head at the look. `directions`: (n, 2) [rad], of the attended object. The paper's
    motor command is the difference `directions - postures`.

    What a robot with more senses measures is NaN where it was not measured, and everywhere where
    the looks were made without these senses. `gazes`: (n, 9), of landmarks, rows of
    `FaceGaze.as_row`. `face_ranges`, `object_ranges`: (n, 2) [m], distances to the surface of her
    face and of the attended object, as the detections have them, and their standard deviations.
    The robot looked at the object for its range. `face_distances`, `object_distances`: (n,) [m],
    the true distances to their centres, for the experiment that places things there; the learner
    never receives them. All distances are from the robot's camera.
    """

    faces: NDArray[np.uint8]
    faces_at: NDArray[np.float64]
    postures: NDArray[np.float64]
    directions: NDArray[np.float64]
    gazes: NDArray[np.float64] = field(default_factory=_unknown)
    face_ranges: NDArray[np.float64] = field(default_factory=_unknown)
    object_ranges: NDArray[np.float64] = field(default_factory=_unknown)
    face_distances: NDArray[np.float64] = field(default_factory=_unknown)
    object_distances: NDArray[np.float64] = field(default_factory=_unknown)

    def __post_init__(self) -> None:
        for name, columns in _SENSES.items():
            if not getattr(self, name).size:
                object.__setattr__(self, name, np.full((len(self), *columns), np.nan))

    def __len__(self) -> int:
        return len(self.faces)

    def __getitem__(self, chosen: slice) -> Looks:
        return Looks(*(getattr(self, each.name)[chosen] for each in fields(self)))


@dataclass(frozen=True)
class LooksOrder:
    """Which looks: at the caregiver of a scene and seed, so many, at (width, height) [px].

    `senses`: the robot has a reader of landmarks, and a depth sensor, if the scene does not name
    another. `photo`: file with the head of a photograph, which plays her; '': as in the scene.
    """

    scene: str
    seed: int
    count: int
    senses: bool = False
    image_size: tuple[int, int] = IMAGE_SIZE
    photo: str = ''

    def load_scene(self) -> Scene:
        """Return the scene, with the photograph that plays her. Raises SceneError."""
        scene = load_scene(self.scene)
        if not self.photo:
            return scene
        return replace(scene, caregiver=replace(scene.caregiver, photo=self.photo))

    @property
    def name(self) -> str:
        """Return the name of their folder in the cache."""
        name = f'looks-{Path(self.scene).stem}-{self.seed}-{self.count}'
        if self.senses:
            name += '-senses'
        if self.image_size != IMAGE_SIZE:
            name += '-{}x{}'.format(*self.image_size)
        if self.photo:
            name += f'-{Path(self.photo).stem}'
        return name


Render = Callable[[LooksOrder, Callable[[int], None]], Looks]
"""Makes the looks of an order, and reports the number finished since its last call."""


def load_looks(
    scene: str = 'default',
    seed: int = 0,
    count: int = POOL + FRESH,
    folder: Path | None = None,
    report: Callable[[str], None] = print,
    progress: Callable[[int], None] = lambda more: None,
    render: Render | None = None,
    senses: bool = False,
    image_size: tuple[int, int] = IMAGE_SIZE,
    photo: str = '',
) -> Looks:
    """Return looks at the caregiver of a scene and seed, from `folder` or newly rendered.

    Cached looks are used only if their checksum is right and if what made them is unchanged:
    the arguments, sources of the sim and of the perception, libraries. `report` receives one line
    when looks are rendered, `progress` the number of looks that are finished since its last call.
    `render`: makes the looks; None: the rendered world. `senses`, `image_size`, `photo`: as in
    `LooksOrder`.
    """
    order = LooksOrder(scene, seed, count, senses, image_size, photo)
    kept = (folder or cache_folder()) / order.name
    maker = _maker(order)
    try:
        looks = _read(kept, maker)
    except _NotUsableError as why:
        report(f'Rendering {count} looks at the caregiver ({why}).')
    else:
        progress(count)
        return looks
    looks = (render or _render)(order, progress)
    try:
        _write(kept, maker, looks)
    except OSError as error:
        report(f'The looks are used, but not cached: {why_not_written(kept, error)}.')
    return looks


class _NotUsableError(Exception):
    """The cached looks cannot be used; the message gives the reason."""


def _read(kept: Path, maker: dict[str, Any]) -> Looks:
    if not kept.exists():
        raise _NotUsableError(f'none are cached in {kept}')
    try:
        manifest = load_json(kept / 'manifest.json')
        data = read_bytes(kept / 'looks.npz', _LARGEST_BYTES)
    except ConfigError as error:
        raise _NotUsableError(f'those in {kept} cannot be read: {error}') from None
    made_by = manifest.get('made_by')
    if manifest.get('sha256') != _sha256([data]) or not isinstance(made_by, dict):
        raise _NotUsableError(f'those in {kept} are damaged')
    changed = [key for key, value in maker.items() if made_by.get(key) != value]
    if changed:
        raise _NotUsableError(f'those in {kept} were made with other {", ".join(changed)}')
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return Looks(**{each.name: arrays[each.name] for each in fields(Looks)})
    except (KeyError, ValueError, OSError, zipfile.BadZipFile) as error:
        raise _NotUsableError(f'those in {kept} cannot be read: {error}') from None


def _write(kept: Path, maker: dict[str, Any], looks: Looks) -> None:
    """Write the folder in one atomic step: two processes may write it at the same time."""
    made = kept.with_name(f'.{kept.name}.{os.getpid()}')
    try:
        made.mkdir(parents=True)
        np.savez_compressed(made / 'looks.npz', **vars(looks))
        manifest = {
            'sha256': _sha256([(made / 'looks.npz').read_bytes()]),
            'made_at': time.strftime('%Y-%m-%dT%H:%M:%S%z'),
            'made_by': maker,
        }
        (made / 'manifest.json').write_text(json.dumps(manifest, indent=2), encoding='utf-8')
        shutil.rmtree(kept, ignore_errors=True)
        made.rename(kept)
    except OSError:
        shutil.rmtree(made, ignore_errors=True)
        raise


def _maker(order: LooksOrder) -> dict[str, Any]:
    """Return everything that the looks depend on."""
    scene = order.load_scene()
    photo = scene.caregiver.photo
    return {
        # The photograph by its content: its file may stand anywhere.
        'scene': repr(replace(scene, caregiver=replace(scene.caregiver, photo=''))),
        'photo': _sha256([read_bytes(Path(photo), _LARGEST_BYTES)]) if photo else '',
        'seed': order.seed,
        'count': order.count,
        'senses': order.senses,
        'image_size': list(order.image_size),
        'sources': _sha256(_sources(order.senses)),
        **{library: metadata.version(library) for library in _LIBRARIES},
        # Not by metadata: OpenCV comes in packages of several names.
        'opencv': cv2.__version__,
    }


def _sources(senses: bool) -> Iterator[bytes]:
    """Yield the core modules and data that make a look, and the modules of its procedure."""
    for package in _MADE_BY:
        root = Path(str(resources.files(package)))
        # The nodes take no part in rendering.
        for path in sorted(p for p in root.rglob('*') if p.suffix in _FILES):
            unused = path.suffix == _WEIGHTS and path.name != _FACE_DETECTOR and not senses
            if path.parent != root and not unused:
                yield path.relative_to(root).as_posix().encode()
                yield path.read_bytes()
    root = Path(str(resources.files('ja_experiments')))
    for name in ('datasets/looks.py', 'datasets/rendered.py', 'agents/robot.py'):
        yield (root / name).read_bytes()


def _sha256(chunks: Iterator[bytes] | list[bytes]) -> str:
    digest = hashlib.sha256()
    for chunk in chunks:
        digest.update(chunk)
    return digest.hexdigest()


class _Aside(FixedTurn):
    """Turns aside from her: always alike, or to where the experiment points."""

    def point(self, turn: NDArray[np.float64]) -> None:
        """Turn by this, (2,) [rad], from the next image on."""
        self._turn = turn


def _render(order: LooksOrder, progress: Callable[[int], None]) -> Looks:
    """Render looks: look at the caregiver, wait, look aside, and repeat.

    A robot with a sense of depth looks at the attended object instead of aside, so that its range
    is measured.
    """
    config = ExperimentConfig().with_settings(
        {'dwell_s': DWELL_S, 'max_shifts': 1, 'gating': 'constant', 'p_lm_max': 1.0}
    )
    scene = order.load_scene()
    if order.senses and scene.senses.depth == 'none':
        scene = replace(scene, senses=replace(scene.senses, depth='sensor'))
    world = JointAttentionWorld(scene, order.seed, order.image_size)
    aside = _Aside(_ASIDE_RAD)
    robot = Robot(config, aside, np.random.default_rng(order.seed))
    task = RenderedTask(world, robot, GazeReader() if order.senses else None)
    looks: list[dict[str, ArrayLike]] = []
    trial = 0
    try:
        # The range of the last object is measured after its look.
        while len(looks) < order.count or order.senses:
            if order.senses:
                truth = world.truth()
                aside.point(truth.directions[truth.attended] - truth.face_direction)
            sight = task.advance()
            if sight.truth.trial == trial and looks:
                looks[-1]['object_ranges'] = _attended_range(sight, looks[-1]['object_ranges'])
            watched = sight.step.decision.phase is Phase.SHIFT
            # If she did not notice that the robot looked away, it is the same look.
            if not watched or not _shows_face(sight) or sight.truth.trial <= trial:
                continue
            if len(looks) == order.count:
                break
            trial = sight.truth.trial
            looks.append(_look(sight))
            progress(1)
    finally:
        world.close()
    return Looks(**{name: np.array([look[name] for look in looks]) for name in looks[0]})


def _shows_face(sight: RenderedStep) -> bool:
    percept = sight.percept
    return caregiver_face(percept.detections) is not None and percept.face_image is not None


def _look(sight: RenderedStep) -> dict[str, ArrayLike]:
    """Return one look, by the names of the fields of `Looks`."""
    truth, percept = sight.truth, sight.percept
    face = caregiver_face(percept.detections)
    assert face is not None
    assert percept.face_image is not None
    gaze = percept.face_gaze
    return {
        'faces': percept.face_image,
        'faces_at': directions_of_rays(sight.posture.position, face.ray),
        'postures': sight.posture.position,
        'directions': truth.directions[truth.attended],
        'gazes': np.full(9, np.nan) if gaze is None else gaze.as_row(),
        'face_ranges': face.range,
        'object_ranges': np.full(2, np.nan),
        'face_distances': float(np.linalg.norm(truth.face_position)),
        'object_distances': float(np.linalg.norm(truth.positions[truth.attended])),
    }


def _attended_range(sight: RenderedStep, known: ArrayLike) -> ArrayLike:
    """Return the range (2,) [m] of the attended object in this image; if it has none, `known`."""
    attended = sight.truth.directions[sight.truth.attended]
    here = sight.posture.position
    near = [
        seen
        for seen in objects(sight.percept.detections)
        if angle_between(directions_of_rays(here, seen.ray), attended) < SAME_OBJECT_RAD
    ]
    ranges = [seen.range for seen in near if np.isfinite(seen.range_m)]
    return ranges[0] if ranges else known
