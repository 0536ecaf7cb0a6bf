"""A data set of trials in a folder: `trials.parquet`, `faces/*.png`, and its card, `README.md`.

The folder needs nothing of this project: any tool reads the table and the pictures.
"""

from __future__ import annotations

import platform
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata, resources
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow
import pyarrow.parquet
from jinja2 import Environment, StrictUndefined
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_learning.core.trial import Trial, checked_face

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
    folder: Path, samples: Iterable[TrialSample], options: Sequence[str], licence: str
) -> Path:
    """Write a data set into a new folder; return the path of its card.

    For the card, `options`: ROS arguments of the export; `licence`: '' when it is not stated.
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
    card = _card(recordings, known, options, licence)
    (folder / CARD).write_text(card, encoding='utf-8')
    schema = pyarrow.schema([(name, kind) for name, (kind, _) in COLUMNS.items()])
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(rows, schema), folder / TABLE)
    return folder / CARD


def read_dataset(folder: Path) -> list[TrialSample]:
    """Return the trials of a data set.

    Raises ConfigError when the folder holds no data set, or a damaged one.
    """
    try:
        rows = pyarrow.parquet.read_table(folder / TABLE).to_pylist()
    except FileNotFoundError:
        raise ConfigError(f'{folder} is no data set: it has no {TABLE}') from None
    except pyarrow.ArrowInvalid as error:
        raise ConfigError(f'{folder / TABLE} cannot be read: {error}') from None
    lacking = set(COLUMNS).difference(*rows[:1])
    if lacking:
        raise ConfigError(f'{folder / TABLE} lacks {", ".join(sorted(lacking))}')
    return [_sample(folder, row) for row in rows]


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
    picture = cv2.imread(str(folder / row['face']), cv2.IMREAD_UNCHANGED)
    try:
        face = checked_face(np.asarray(picture))
    except ValueError as error:
        raise ConfigError(f'{folder / row["face"]}: {error}') from None
    trial = Trial(
        face,
        np.array([row['face_pan_rad'], row['face_tilt_rad']], float),
        _pairs(row, 'postures'),
        np.array([row['fixation_pan_rad'], row['fixation_tilt_rad']]),
        _pairs(row, 'candidates'),
        row['seen_before_shift'],
    )
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


def _pairs(row: Mapping[str, Any], name: str) -> NDArray[np.float64]:
    return np.column_stack([np.array(row[f'{name}_{axis}_rad'], float) for axis in _AXES])


def _direction(row: Mapping[str, Any], name: str) -> NDArray[np.float64] | None:
    direction = np.array([row[f'{name}_{axis}_rad'] for axis in _AXES], float)
    # Some tools write NaN for a missing value.
    return direction if np.isfinite(direction).all() else None


def _card(
    recordings: Mapping[str, int], known: Mapping[str, int], options: Sequence[str], licence: str
) -> str:
    template = (resources.files('ja_recording') / 'dataset_card.md').read_text('utf-8')
    versions = {name: metadata.version(name) for name in ('ja_recording', 'numpy', 'pyarrow')}
    return (
        Environment(undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True)
        .from_string(template)
        .render(
            recordings=recordings,
            known=known,
            options=' '.join(options),
            licence=licence or _LICENCE_UNSTATED,
            columns={name: (str(kind), text) for name, (kind, text) in COLUMNS.items()},
            versions={'Python': platform.python_version(), **versions},
        )
    )
