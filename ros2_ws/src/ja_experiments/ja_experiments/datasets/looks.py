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
from dataclasses import dataclass, fields
from importlib import metadata, resources
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.cache import cache_folder
from ja_common.core.config import ConfigError
from ja_common.core.detection import caregiver_face
from ja_common.core.files import why_not_written
from ja_common.core.geometry import directions_of_rays
from ja_common.core.safe_files import load_json, read_bytes
from ja_control.core.attention_cycle import Phase
from ja_experiments.agents.robot import FixedTurn, Robot
from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.rendered import DWELL_S, RenderedTask
from ja_sim.core.scene import load_scene
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


@dataclass(frozen=True)
class Looks:
    """Pictures of the caregiver's face, and directions of the object that she looked at.

    `faces`: uint8 (n, 30, 25), seen in the directions `faces_at`, (n, 2) [rad]. `postures`: (n, 2)
    [rad], of the head at the look. `directions`: (n, 2) [rad], of the attended object. The paper's
    motor command is the difference `directions - postures`.
    """

    faces: NDArray[np.uint8]
    faces_at: NDArray[np.float64]
    postures: NDArray[np.float64]
    directions: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.faces)

    def __getitem__(self, chosen: slice) -> Looks:
        return Looks(*(getattr(self, field.name)[chosen] for field in fields(self)))


Render = Callable[[str, int, int, Callable[[int], None]], Looks]
"""Makes looks of (scene, seed, count, progress)."""


def load_looks(
    scene: str = 'default',
    seed: int = 0,
    count: int = POOL + FRESH,
    folder: Path | None = None,
    report: Callable[[str], None] = print,
    progress: Callable[[int], None] = lambda more: None,
    render: Render | None = None,
) -> Looks:
    """Return looks at the caregiver of a scene and seed, from `folder` or newly rendered.

    Cached looks are used only if their checksum is right and if what made them is unchanged:
    scene, seed, sources of the sim and of the perception, libraries. `report` receives one line
    when looks are rendered, `progress` the number of looks that are finished since its last call.
    `render`: makes the looks of (scene, seed, count, progress); None: the rendered world.
    """
    kept = (folder or cache_folder()) / f'looks-{Path(scene).stem}-{seed}-{count}'
    maker = _maker(scene, seed, count)
    try:
        looks = _read(kept, maker)
    except _NotUsableError as why:
        report(f'Rendering {count} looks at the caregiver ({why}).')
    else:
        progress(count)
        return looks
    looks = (render or _render)(scene, seed, count, progress)
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
            return Looks(**{field.name: arrays[field.name] for field in fields(Looks)})
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


def _maker(scene: str, seed: int, count: int) -> dict[str, Any]:
    """Return everything that the looks depend on."""
    return {
        'scene': repr(load_scene(scene)),
        'seed': seed,
        'count': count,
        'sources': _sha256(_sources()),
        **{library: metadata.version(library) for library in _LIBRARIES},
        # Not by metadata: OpenCV comes in packages of several names.
        'opencv': cv2.__version__,
    }


def _sources() -> Iterator[bytes]:
    """Yield the core modules and data that make a look, and the modules of its procedure."""
    for package in _MADE_BY:
        root = Path(str(resources.files(package)))
        # The nodes take no part in rendering.
        for path in sorted(p for p in root.rglob('*') if p.suffix in _FILES):
            if path.parent != root:
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


def _render(scene: str, seed: int, count: int, progress: Callable[[int], None]) -> Looks:
    """Render looks: look at the caregiver, wait, look aside, and repeat."""
    config = ExperimentConfig().with_settings(
        {'dwell_s': DWELL_S, 'max_shifts': 1, 'gating': 'constant', 'p_lm_max': 1.0}
    )
    world = JointAttentionWorld(load_scene(scene), seed, IMAGE_SIZE)
    task = RenderedTask(world, Robot(config, FixedTurn(_ASIDE_RAD), np.random.default_rng(seed)))
    faces: list[NDArray] = []
    faces_at: list[NDArray] = []
    postures: list[NDArray] = []
    directions: list[NDArray] = []
    trial = 0
    try:
        while len(faces) < count:
            sight = task.advance()
            watched = sight.step.decision.phase is Phase.SHIFT
            face, picture = caregiver_face(sight.percept.detections), sight.percept.face_image
            # If she did not notice that the robot looked away, it is the same look.
            if not watched or face is None or picture is None:
                continue
            if sight.truth.trial > trial:
                trial = sight.truth.trial
                faces.append(picture)
                faces_at.append(directions_of_rays(sight.posture.position, face.ray))
                postures.append(sight.posture.position)
                directions.append(sight.truth.directions[sight.truth.attended])
                progress(1)
    finally:
        world.close()
    return Looks(*map(np.array, (faces, faces_at, postures, directions)))
