"""Data sets of trials: written, read, and labelled by a person."""

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from ja_common.core.config import ConfigError
from ja_recording.core import dataset
from ja_recording.core.dataset import COLUMNS, TABLE, TrialSample, read_dataset, write_dataset
from synthetic_trials import synthetic_samples


@pytest.fixture
def samples() -> list[TrialSample]:
    return synthetic_samples()


@pytest.fixture
def folder(tmp_path: Path, samples: list[TrialSample]) -> Path:
    return write_dataset(tmp_path / 'data', samples, (), 'CC0').parent


def same(a: TrialSample, b: TrialSample) -> bool:
    arrays = ('face', 'face_at', 'postures', 'fixation', 'candidates', 'seen_before_shift')
    trials = all(np.array_equal(getattr(a.trial, n), getattr(b.trial, n)) for n in arrays)
    without = {'trial': a.trial, 'attended_direction': None, 'label': None}
    others = replace(a, **without) == replace(b, **without)
    targets = [
        np.array_equal(getattr(a, n), getattr(b, n)) for n in ('attended_direction', 'label')
    ]
    return trials and others and all(targets)


def test_what_is_written_is_read(samples: list[TrialSample], folder: Path) -> None:
    read = read_dataset(folder)
    assert len(read) == len(samples)
    assert all(same(a, b) for a, b in zip(samples, read, strict=True))


def test_the_card_names_every_column(folder: Path) -> None:
    card = (folder / 'README.md').read_text()
    assert all(f'| `{name}` |' in card for name in COLUMNS)
    assert 'Licence: CC0.' in card


def test_a_data_set_is_never_overwritten(samples: list[TrialSample], folder: Path) -> None:
    with pytest.raises(ConfigError, match='name another folder'):
        write_dataset(folder, samples, (), '')


def test_a_damaged_data_set_is_refused(folder: Path) -> None:
    (folder / 'faces' / '000007.png').write_bytes(b'no picture')
    with pytest.raises(ConfigError, match=r'000007\.png: a face is uint8'):
        read_dataset(folder)
    (folder / TABLE).write_bytes(b'no table')
    with pytest.raises(ConfigError, match='cannot be read'):
        read_dataset(folder)
    with pytest.raises(ConfigError, match='is no data set'):
        read_dataset(folder / 'faces')


@pytest.mark.parametrize('unknown', [None, float('nan')])
def test_a_label_goes_before_the_truth(folder: Path, unknown: float | None) -> None:
    rows = pyarrow.parquet.read_table(folder / TABLE).to_pylist()
    for row in rows:
        row |= {'label_pan_rad': unknown, 'label_tilt_rad': unknown}
    rows[3] |= {'label_pan_rad': 0.25, 'label_tilt_rad': -0.5}
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(rows), folder / TABLE)
    targets = [sample.target for sample in read_dataset(folder)]
    assert [by for by, _ in targets[:5]] == ['truth', 'truth', 'truth', 'label', 'truth']
    np.testing.assert_array_equal(targets[3][1], [0.25, -0.5])


def rewritten(folder: Path, **changes: object) -> None:
    """Change the first row of the table."""
    rows = pyarrow.parquet.read_table(folder / TABLE).to_pylist()
    rows[0] |= changes
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(rows), folder / TABLE)


@pytest.mark.parametrize(
    ('changes', 'why'),
    [
        ({'face': '../../secret.png'}, 'not in the folder'),
        ({'face': '/etc/passwd'}, 'not in the folder'),
        ({'face': 'faces'}, 'is a folder'),
        ({'face': 'faces/none.png'}, 'no such file'),
        ({'face': None}, 'row 1'),
        ({'face': 'a\0b'}, 'cannot be read'),
        ({'face_pan_rad': None}, 'lack'),
        ({'fixation_pan_rad': float('inf')}, 'lack'),
        ({'postures_pan_rad': []}, 'row 1'),
        ({'postures_pan_rad': [], 'postures_tilt_rad': []}, 'lack'),
        ({'postures_pan_rad': None}, 'row 1'),
        ({'candidates_pan_rad': [0.1, float('nan')], 'candidates_tilt_rad': [0.1, 0.2]}, 'pairs'),
        ({'candidates_pan_rad': [None], 'candidates_tilt_rad': [0.1]}, 'pairs'),
        ({'seen_before_shift': None}, 'row 1'),
        ({'seen_before_shift': -1}, 'seen_before_shift'),
    ],
    ids=lambda changes: repr(changes)[:40],
)
def test_a_row_that_is_no_trial_is_refused_in_one_sentence(changes, why, folder: Path) -> None:
    rewritten(folder, **changes)
    with pytest.raises(ConfigError, match=why) as refused:
        read_dataset(folder)
    assert '\n' not in str(refused.value)


def test_a_table_of_other_types_is_refused(folder: Path) -> None:
    table = pyarrow.parquet.read_table(folder / TABLE)
    for name in ('face', 'postures_pan_rad', 'seen_before_shift'):
        index = table.column_names.index(name)
        other = table.set_column(index, name, pyarrow.array([{'a': 'x'}] * len(table)))
        pyarrow.parquet.write_table(other, folder / TABLE)
        with pytest.raises(ConfigError, match='cannot be read'):
            read_dataset(folder)


def test_a_small_file_of_a_large_table_is_refused(folder: Path, monkeypatch) -> None:
    monkeypatch.setattr(dataset, '_MOST_VALUES', 100)
    with pytest.raises(ConfigError, match='more than are read'):
        read_dataset(folder)


def test_a_picture_that_claims_to_be_large_is_not_decoded(folder: Path) -> None:
    huge = struct.pack('>I4sIIBBBBB', 13, b'IHDR', 10**5, 10**5, 8, 0, 0, 0, 0)
    (folder / 'faces' / '000000.png').write_bytes(b'\x89PNG\r\n\x1a\n' + huge)
    with pytest.raises(ConfigError, match=r'000000\.png is no picture of a face'):
        read_dataset(folder)
    (folder / 'faces' / '000000.png').write_bytes(bytes(10**6))
    with pytest.raises(ConfigError, match='larger than'):
        read_dataset(folder)
