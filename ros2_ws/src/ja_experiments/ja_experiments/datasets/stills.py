"""Looks from a folder of stills whose names, or a table, state where each face looks.

Names as those of the Columbia Gaze data set (Smith et al. 2013): `0001_2m_-15P_10V_-5H.jpg` is
subject 1 at 2 m, with the head turned by -15 degrees, and a gaze of 10 degrees up and -5 degrees
aside. Or a table `stills.csv` in the folder, in degrees:

    file,person,distance_m,head_pan,head_tilt,gaze_pan,gaze_tilt
    anna_01.jpg,anna,1.2,10,0,20,-5

Angles of gaze are from the line between face and camera: 0 looks into the camera. Positive pan is
towards the left of the picture, positive tilt downwards, as for the robot's head. In file names V
is positive upwards, and H is taken as pan; which side is positive there makes no difference to a
learner that learns from these stills alone.

A still states an angle and no thing. So a thing is placed on her line of gaze, where it comes as
near to the camera as `THING_AT` of her distance.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.config import ConfigError
from ja_common.core.safe_files import read_text
from ja_common.core.sample_depth import SampleDepth
from ja_experiments.datasets.looks import Looks
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.box import Box
from ja_perception.core.detector import AttentionConfig
from ja_perception.core.face_crop import FACE_COLUMNS, FACE_ROWS, crop_face
from ja_perception.core.face_tracking import scan_squares
from ja_perception.core.faces import Face, FaceFinder
from ja_perception.core.frame_sources import SourceError
from ja_perception.core.gaze_reader import GazeReader
from ja_perception.core.pictures import PICTURE_SUFFIXES, read_picture

TABLE = 'stills.csv'
THING_AT = 0.4
"""How far the thing is from the camera, as a share of her distance."""
_COLUMNS = ('file', 'person', 'distance_m', 'head_pan', 'head_tilt', 'gaze_pan', 'gaze_tilt')
_NAME = re.compile(
    r'(?P<person>[^_]+)_(?P<m>\d+(\.\d+)?)m_(?P<P>-?\d+)P_(?P<V>-?\d+)V_(?P<H>-?\d+)H'
)
_LARGEST_WIDTH = 1280
_VIEW_RAD = math.radians(40)
_MOST_STILLS = 100_000
_FARTHEST_M, _MOST_DEG = 100.0, 90.0


@dataclass(frozen=True)
class Still:
    """A still and what it shows: distance [m], head pose and gaze (pan, tilt) [rad]."""

    path: Path
    person: str
    distance_m: float
    head: tuple[float, float]
    gaze: tuple[float, float]


def list_stills(folder: Path) -> list[Still]:
    """Return the stills of a folder, from its table or else from the names, in a fixed order.

    Raises ConfigError that names the folder, or the line of the table.
    """
    if not folder.is_dir():
        raise ConfigError(f"no such folder: '{folder}'")
    if (folder / TABLE).exists():
        stills = _read_table(folder)
    else:
        paths = sorted(p for p in folder.rglob('*') if p.suffix.lower() in PICTURE_SUFFIXES)
        stills = [still for path in paths if (still := _read_name(path)) is not None]
    if not stills:
        raise ConfigError(
            f'{folder} holds no stills: it needs {TABLE}, or pictures with names such as '
            '0001_2m_-15P_10V_-5H.jpg'
        )
    if len(stills) > _MOST_STILLS:
        raise ConfigError(f'{folder} holds more than {_MOST_STILLS} stills')
    return stills


def load_stills(
    folder: Path,
    warn: Callable[[str], None] = print,
    finder: FaceFinder | None = None,
    reads_gaze: bool = False,
) -> dict[str, Looks]:
    """Return the looks of each person in a folder of stills, by name, in rising order.

    `warn` receives a sentence for each still that is left out: no face, or no picture.
    `reads_gaze`: landmarks are read, too. Raises ConfigError where nothing is left.
    """
    finder = finder or BlazeFace()
    reader = GazeReader() if reads_gaze else None
    rows: dict[str, list[dict[str, NDArray]]] = {}
    for still in list_stills(folder):
        try:
            row = _look(still, finder, reader)
        except SourceError as error:
            warn(f'left out: {error}')
            continue
        if row is None:
            warn(f"left out: no face is found in '{still.path}'")
        else:
            rows.setdefault(still.person, []).append(row)
    if not rows:
        raise ConfigError(f'{folder}: no face is found in any of its stills')
    return {
        person: Looks(**{name: np.array([row[name] for row in found]) for name in found[0]})
        for person, found in sorted(rows.items())
    }


def thing_direction(gaze: tuple[float, float], thing_at: float = THING_AT) -> NDArray[np.float64]:
    """Return where the robot sees the thing, (2,) [rad] from her face.

    `gaze`: (pan, tilt) [rad] of her line of gaze, from the line between face and camera.
    `thing_at`: distance of the thing from the camera, as a share of hers; where her line of gaze
    does not come as near, the thing is where it comes nearest.
    """
    off = math.hypot(*gaze)
    if off == 0.0:
        return np.zeros(2)
    sine = min(1.0, math.sin(min(off, math.pi / 2)) / thing_at)
    return np.array(gaze) / off * max(math.asin(sine) - off, 0.0)


def _look(still: Still, finder: FaceFinder, reader: GazeReader | None) -> dict | None:
    """Return one look by the names of the fields of `Looks`; None where no face is found."""
    picture = _bounded(read_picture(still.path, SampleDepth(16), lambda *_: None)[0].pixels)
    height, width = picture.shape[:2]
    face = _largest_face(picture, finder)
    if face is None:
        return None
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    side = AttentionConfig().crop_widths * face.box.width
    box = Box(face.box.u, face.box.v, side, side * FACE_ROWS / FACE_COLUMNS)
    gaze = np.full(9, np.nan)
    if reader is not None:
        camera = CameraModel.from_field_of_view(width, height, _VIEW_RAD)
        reading = reader.read(picture, face.box, camera)
        gaze = gaze if reading is None else reading.gaze.as_row()
    return {
        'faces': crop_face(grey, box),
        'faces_at': np.zeros(2),
        'postures': np.zeros(2),
        'directions': thing_direction(still.gaze),
        'gazes': gaze,
        'face_distances': np.array(still.distance_m),
        'object_distances': np.array(THING_AT * still.distance_m),
    }


def _largest_face(picture: NDArray[np.uint8], finder: FaceFinder) -> Face | None:
    height, width = picture.shape[:2]
    found = [
        face
        for square in scan_squares(width, height, max(width, height) / 4)
        for face in finder.find_faces(picture, square)
    ]
    return max(found, key=lambda face: face.score * face.box.width, default=None)


def _bounded(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    height, width = picture.shape[:2]
    if width <= _LARGEST_WIDTH:
        return picture
    size = (_LARGEST_WIDTH, max(1, round(height * _LARGEST_WIDTH / width)))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def _read_name(path: Path) -> Still | None:
    found = _NAME.fullmatch(path.stem)
    if found is None:
        return None
    pose, up, aside = (math.radians(float(found[name])) for name in 'PVH')
    distance_m = float(found['m'])
    if not 0 < distance_m <= _FARTHEST_M:
        return None
    return Still(path, found['person'], distance_m, (pose, 0.0), (aside, -up))


def _read_table(folder: Path) -> list[Still]:
    path = folder / TABLE
    lines = csv.DictReader(read_text(path).splitlines(), restkey='', restval='')
    missing = [name for name in _COLUMNS if name not in (lines.fieldnames or ())]
    if missing:
        raise ConfigError(f'{path}:1: the table lacks the columns {", ".join(missing)}')
    try:
        return [_read_row(folder, f'{path}:{lines.line_num}', row) for row in lines]
    except csv.Error as error:
        raise ConfigError(f'{path}:{lines.line_num}: no table (CSV): {error}') from None


def _read_row(folder: Path, at: str, row: Mapping[str, str]) -> Still:
    def angle(name: str) -> float:
        return math.radians(_number(at, row, name, -_MOST_DEG, _MOST_DEG))

    path = folder / row['file']
    if not row['file'] or not path.resolve().is_relative_to(folder.resolve()):
        raise ConfigError(f'{at}: file = {row["file"]!r} is no file in this folder')
    return Still(
        path,
        row['person'] or 'person',
        _number(at, row, 'distance_m', 0.1, _FARTHEST_M),
        (angle('head_pan'), angle('head_tilt')),
        (angle('gaze_pan'), angle('gaze_tilt')),
    )


def _number(at: str, row: Mapping[str, str], name: str, low: float, high: float) -> float:
    try:
        value = float(row[name])
    except ValueError:
        raise ConfigError(f'{at}: {name} = {row[name][:50]!r} is no number') from None
    if not low <= value <= high:
        raise ConfigError(f'{at}: {name} = {row[name][:50]} is outside [{low:g}, {high:g}]')
    return value
