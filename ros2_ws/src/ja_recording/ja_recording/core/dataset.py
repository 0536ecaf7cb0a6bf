"""A data set of trials in a folder: `trials.parquet`, `faces/*.png`, and its card, `README.md`.

The folder needs nothing of this project: any tool reads the table and the pictures.
"""

from __future__ import annotations

import platform
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata, resources
from pathlib import Path, PurePath
from typing import Any

import cv2
import numpy as np
import pyarrow
import pyarrow.parquet
from jinja2 import Environment, StrictUndefined
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_common.core.picture_size import picture_size
from ja_common.core.safe_files import read_bytes
from ja_learning.core.trial import FACE_SHAPE, Trial, checked_face

TABLE, FACES, CARD = 'trials.parquet', 'faces', 'README.md'
_LICENCE_UNSTATED = 'not stated: ask the person who recorded it before you pass it on'
_AXES = ('pan', 'tilt')
_ANGLES = pyarrow.list_(pyarrow.float64())

COLUMNS: Mapping[str, tuple[pyarrow.DataType, str]] = {
    'trial': (pyarrow.int64(), 'number of the trial in this data set, from 0'),
    'recording': (pyarrow.string(), 'the recording that it comes from'),
    'look_stamp_ns': (pyarrow.int64(), 'stamp [ns] of the image on which the face was last seen'),
    'fixation_stamp_ns': (pyarrow.int64(), 'stamp [ns] of the image on which it ended'),
    'face': (pyarrow.string(), 'picture of the face: 8 bits grey, 30 rows x 25 columns'),
    'face_pan_rad': (pyarrow.float64(), 'direction [rad] in which the face was seen'),
    'face_tilt_rad': (pyarrow.float64(), 'the same for tilt [rad]'),
    'postures_pan_rad': (
        _ANGLES,
        'where each shift began [rad]; first, the look at the caregiver',
    ),
    'postures_tilt_rad': (_ANGLES, 'the same for tilt [rad]'),
    'candidates_pan_rad': (_ANGLES, 'directions [rad] of the objects seen in the trial'),
    'candidates_tilt_rad': (_ANGLES, 'the same for tilt [rad]'),
    'seen_before_shift': (pyarrow.int64(), 'number of candidates seen before the first shift'),
    'fixation_pan_rad': (pyarrow.float64(), 'direction [rad] of the object fixated at the end'),
    'fixation_tilt_rad': (pyarrow.float64(), 'the same for tilt [rad]'),
    'source': (pyarrow.string(), 'module of the last shift: VF (visual feedback) or LM (learner)'),
    'meant_pan_rad': (
        pyarrow.float64(),
        'direction [rad] of the attended object; simulation only',
    ),
    'meant_tilt_rad': (pyarrow.float64(), 'the same for tilt [rad]'),
    'joint_attention': (pyarrow.bool_(), 'was the attended object fixated? simulation only'),
    'label_pan_rad': (
        pyarrow.float64(),
        'the attended direction [rad] as a person judged; fill it in',
    ),
    'label_tilt_rad': (pyarrow.float64(), 'the same for tilt [rad]'),
}
"""Type and meaning of every column, in their order."""

_SCHEMA = pyarrow.schema([(name, kind) for name, (kind, _) in COLUMNS.items()])
# What is read: of a table, tens of millions of trials; of a picture of 750 pixels, a hundredfold.
_MOST_VALUES = 10**8
_LARGEST_BYTES = 2**30
_LARGEST_FACE_BYTES = 2**16


@dataclass(frozen=True)
class TrialSample:
    """One trial: what the learner learned from, and what else is known of it.

    `attended_direction`: (2,) [rad] of the object that the caregiver attended to, from the truth
    of a simulation; `label`: the same, (2,) [rad], as a person judged it afterwards. Both None
    where it is not known.
    """

    trial: Trial
    recording: str
    look_ns: int
    fixation_ns: int
    source: str | None = None
    attended_direction: NDArray[np.float64] | None = None
    joint_attention: bool | None = None
    label: NDArray[np.float64] | None = None

    @property
    def target(self) -> tuple[str, NDArray[np.float64]]:
        """Return how the attended direction is known, and its best estimate (2,) [rad]."""
        if self.label is not None:
            return 'label', self.label
        if self.attended_direction is not None:
            return 'truth', self.attended_direction
        return 'fixation', self.trial.led_to


def write_dataset(
    folder: Path,
    samples: Iterable[TrialSample],
    options: Sequence[str],
    licence: str,
    origins: Mapping[str, Mapping[str, str]] | None = None,
) -> Path:
    """Write a data set into a new folder; return the path of its card.

    For the card, `options`: ROS arguments of the export; `licence`: '' when it is not stated;
    `origins`: by recording, what its learner and its eyes started from, as texts by topic.
    Raises ConfigError when there is a data set already, or when there is nothing to write.
    """
    if (folder / TABLE).exists():
        raise ConfigError(f'{folder} holds a data set already: name another folder')
    (folder / FACES).mkdir(parents=True, exist_ok=True)
    rows, recordings, known = [], Counter[str](), Counter[str]()
    for number, sample in enumerate(samples):
        row = _row(number, sample)
        if not cv2.imwrite(str(folder / row['face']), sample.trial.face):
            raise OSError(f'{folder / row["face"]} cannot be written')
        rows.append(row)
        recordings[sample.recording] += 1
        known[sample.target[0]] += 1
    if not rows:
        raise ConfigError('no trial ended in a fixation: there is nothing to write')
    card = _card(recordings, known, options, licence, origins or {})
    (folder / CARD).write_text(card, encoding='utf-8')
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(rows, _SCHEMA), folder / TABLE)
    return folder / CARD


def read_dataset(folder: Path) -> list[TrialSample]:
    """Return the trials of a data set.

    Raises ConfigError when the folder holds no data set, or a damaged one.
    """
    if not (folder / TABLE).is_file():
        raise ConfigError(f'{folder} is no data set: it has no {TABLE}')
    samples = []
    for number, row in enumerate(_read_table(folder / TABLE).to_pylist(), 1):
        try:
            samples.append(_sample(folder, row))
        except (ValueError, TypeError) as error:
            if isinstance(error, ConfigError):
                raise
            raise ConfigError(f'{folder / TABLE}, row {number}: {error}') from None
    return samples


def _read_table(path: Path) -> pyarrow.Table:
    """Return our columns, in our types. Raises ConfigError."""
    try:
        with pyarrow.parquet.ParquetFile(path) as file:
            lacking = COLUMNS.keys() - set(file.schema_arrow.names)
            if lacking:
                raise ConfigError(f'{path} lacks {", ".join(sorted(lacking))}')
            _check_size(path, file.metadata)
            return file.read(list(COLUMNS)).select(list(COLUMNS)).cast(_SCHEMA)
    except (pyarrow.ArrowException, OSError, ValueError) as error:
        if isinstance(error, ConfigError):
            raise
        why = str(error).partition('\n')[0][:200]
        raise ConfigError(f'{path} cannot be read: {why}') from None


def _check_size(path: Path, metadata: pyarrow.parquet.FileMetaData) -> None:
    """Refuse a small file that would unpack to a large table."""
    groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
    columns = [group.column(number) for group in groups for number in range(group.num_columns)]
    values = sum(column.num_values for column in columns)
    size = sum(column.total_uncompressed_size for column in columns)
    if values > _MOST_VALUES or size > _LARGEST_BYTES:
        raise ConfigError(f'{path} holds {values} values in {size} bytes: more than are read')


def _row(number: int, sample: TrialSample) -> dict[str, Any]:
    trial = sample.trial
    values = {
        'trial': number,
        'recording': sample.recording,
        'look_stamp_ns': sample.look_ns,
        'fixation_stamp_ns': sample.fixation_ns,
        'face': f'{FACES}/{number:06}.png',
        'seen_before_shift': trial.seen_before_shift,
        'source': sample.source,
        'joint_attention': sample.joint_attention,
    }
    for name in ('postures', 'candidates'):
        pan, tilt = getattr(trial, name).T.tolist()
        values |= {f'{name}_pan_rad': pan, f'{name}_tilt_rad': tilt}
    for name, direction in (
        ('face', trial.face_at), ('fixation', trial.fixation),
        ('meant', sample.attended_direction), ('label', sample.label),
    ):  # fmt: skip
        pan, tilt = (None, None) if direction is None else map(float, direction)
        values |= {f'{name}_pan_rad': pan, f'{name}_tilt_rad': tilt}
    return values


def _sample(folder: Path, row: Mapping[str, Any]) -> TrialSample:
    postures, candidates = _pairs(row, 'postures'), _pairs(row, 'candidates')
    face_at, fixation = _direction(row, 'face'), _direction(row, 'fixation')
    seen = row['seen_before_shift']
    if face_at is None or fixation is None or not len(postures):
        raise ValueError('the directions of the face, of the postures or of the fixation lack')
    if seen < 0:
        raise ValueError(f'seen_before_shift = {seen} is no count')
    trial = Trial(_face(folder, row['face']), face_at, postures, fixation, candidates, seen)
    return TrialSample(
        trial,
        row['recording'],
        row['look_stamp_ns'],
        row['fixation_stamp_ns'],
        row['source'],
        _direction(row, 'meant'),
        row['joint_attention'],
        _direction(row, 'label'),
    )


def _face(folder: Path, name: str) -> NDArray[np.uint8]:
    """Return a face; its file lies in the folder, whatever the table says."""
    if PurePath(name).is_absolute() or '..' in PurePath(name).parts:
        raise ValueError(f'face = {name[:100]!r} is not in the folder of the data set')
    data = np.frombuffer(read_bytes(folder / name, _LARGEST_FACE_BYTES), np.uint8)
    if data.size and picture_size(data.data) not in (None, FACE_SHAPE[::-1]):
        raise ConfigError(f'{folder / name} is no picture of a face: it has another size')
    picture = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if data.size else None
    try:
        return checked_face(np.asarray(picture))
    except ValueError as error:
        raise ConfigError(f'{folder / name}: {error}') from None


def _pairs(row: Mapping[str, Any], name: str) -> NDArray[np.float64]:
    pairs = np.column_stack([np.array(row[f'{name}_{axis}_rad'], float) for axis in _AXES])
    if pairs.shape[1:] != (2,) or not np.isfinite(pairs).all():
        raise ValueError(f'{name} are no pairs of angles')
    return pairs


def _direction(row: Mapping[str, Any], name: str) -> NDArray[np.float64] | None:
    direction = np.array([row[f'{name}_{axis}_rad'] for axis in _AXES], float)
    # Some tools write NaN for a missing value.
    return direction if np.isfinite(direction).all() else None


def _card(
    recordings: Mapping[str, int],
    known: Mapping[str, int],
    options: Sequence[str],
    licence: str,
    origins: Mapping[str, Mapping[str, str]],
) -> str:
    template = (resources.files('ja_recording') / 'dataset_card.md').read_text('utf-8')
    versions = {name: metadata.version(name) for name in ('ja_recording', 'numpy', 'pyarrow')}
    return (
        Environment(undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True)
        .from_string(template)
        .render(
            recordings=recordings,
            known=known,
            origins=origins,
            options=' '.join(options),
            licence=licence or _LICENCE_UNSTATED,
            columns={name: (str(kind), text) for name, (kind, text) in COLUMNS.items()},
            versions={'Python': platform.python_version(), **versions},
        )
    )
