"""Data sets of trials: written, read, labelled by a person, and learned from."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from ja_common.core.config import ConfigError
from ja_experiments.datasets.looks import Looks
from ja_experiments.datasets.recorded import places_around, recorded_materials
from ja_experiments.paper.experiment import Plan
from ja_experiments.paper.report import write_report
from ja_experiments.paper.study import StudyConfig, run_study
from ja_experiments.progress import Progress
from ja_learning.core.trial import Trial
from ja_recording.core.dataset import COLUMNS, TABLE, TrialSample, read_dataset, write_dataset
from ja_sim.core.specs import ObjectsSpec


@pytest.fixture
def samples(looks: Looks) -> list[TrialSample]:
    """Trials of two shifts; what is fixated is not what she meant, by a tenth of a radian."""
    rng = np.random.default_rng(0)
    found = []
    for number in range(len(looks)):
        look, meant = looks.postures[number], looks.directions[number]
        seen = rng.normal(size=(number % 4, 2))
        trial = Trial(
            looks.faces[number],
            looks.faces_at[number],
            np.array([look, meant / 3]),
            meant + 0.1,
            seen,
            number % 3,
        )
        found.append(TrialSample(trial, 'a', 10 * number, 10 * number + 5, 'VF', meant, False))
    return found


@pytest.fixture
def folder(tmp_path: Path, samples: list[TrialSample]) -> Path:
    return write_dataset(tmp_path / 'data', samples, (), 'CC0').parent


def same(a: TrialSample, b: TrialSample) -> bool:
    arrays = ('face', 'face_at', 'postures', 'fixation', 'candidates', 'seen_before_shift')
    lessons = all(np.array_equal(getattr(a.lesson, n), getattr(b.lesson, n)) for n in arrays)
    nothing = {'lesson': a.lesson, 'meant': None, 'label': None}
    others = replace(a, **nothing) == replace(b, **nothing)
    targets = [np.array_equal(getattr(a, n), getattr(b, n)) for n in ('meant', 'label')]
    return lessons and others and all(targets)


def test_what_is_written_is_read(samples: list[TrialSample], folder: Path) -> None:
    read = read_dataset(folder)
    assert len(read) == len(samples)
    assert all(same(a, b) for a, b in zip(samples, read, strict=True))


def test_the_card_names_every_column(folder: Path) -> None:
    card = (folder / 'README.md').read_text()
    assert all(f'| `{name}` |' in card for name in COLUMNS)
    assert 'Licence: CC0.' in card


def test_nothing_is_written_over(samples: list[TrialSample], folder: Path) -> None:
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
def test_a_label_wins_over_the_truth(folder: Path, unknown: float | None) -> None:
    rows = pyarrow.parquet.read_table(folder / TABLE).to_pylist()
    for row in rows:
        row |= {'label_pan_rad': unknown, 'label_tilt_rad': unknown}
    rows[3] |= {'label_pan_rad': 0.25, 'label_tilt_rad': -0.5}
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(rows), folder / TABLE)
    targets = [sample.target for sample in read_dataset(folder)]
    assert [by for by, _ in targets[:5]] == ['truth', 'truth', 'truth', 'label', 'truth']
    np.testing.assert_array_equal(targets[3][1], [0.25, -0.5])


def test_looks_are_learned_from_in_their_order(folder: Path, looks: Looks) -> None:
    materials = recorded_materials(folder, 0, 'default')
    assert (len(materials.pool), len(materials.fresh)) == (100, 25)
    np.testing.assert_array_equal(materials.pool.faces, looks.faces[:100])
    np.testing.assert_array_equal(materials.fresh.directions, looks.directions[100:])
    assert '125 by the truth of a simulation' in materials.origin
    assert len(recorded_materials(folder, 120, 'default').pool) == 120
    with pytest.raises(ConfigError, match='left to test on'):
        recorded_materials(folder, 124, 'default')


def test_without_truth_what_was_fixated_is_taken_for_what_she_meant(
    tmp_path: Path, samples: list[TrialSample], looks: Looks
) -> None:
    real = [replace(sample, meant=None, joint_attention=None) for sample in samples]
    materials = recorded_materials(
        write_dataset(tmp_path / 'real', real, (), '').parent, 0, 'default'
    )
    np.testing.assert_array_equal(materials.pool.directions, looks.directions[:100] + 0.1)
    assert 'which may be another object' in materials.origin


def test_objects_are_placed_around_where_she_was_looked_at(places: ObjectsSpec) -> None:
    postures = np.full((3, 2), np.radians([30, -10]))
    directions = np.radians([[30, -10], [75, 0], [20, 30]])
    found = places_around(
        Looks(np.zeros((3, 30, 25), np.uint8), postures, postures, directions), places
    )
    assert found.pan_deg == pytest.approx((-10, 75))
    assert found.tilt_deg == pytest.approx((-25, 30))


def test_the_experiment_learns_from_recorded_looks(
    tmp_path: Path, samples: list[TrialSample]
) -> None:
    """Of somebody who never meant anything out of view."""
    seen = [s for s in samples if (np.abs(s.meant - s.lesson.postures[0]) < (0.28, 0.2)).all()]
    folder = write_dataset(tmp_path / 'data', seen, (), '').parent
    config = StudyConfig(
        plan=Plan(trials=3000, seeds=(0,), test_trials=200), data=str(folder), pool=15
    )
    path = write_report(run_study(config, Progress()), tmp_path / 'report')
    text = path.read_text()
    assert f'15 recorded looks of {len(seen)} (`data`)' in text
    assert f'{len(seen) - 15} other looks' in text
    assert 'Figure 7' not in text
    assert (path.parent / 'figure-6b.png').exists()
    numbers = json.loads((path.parent / 'results.json').read_text(), parse_constant=pytest.fail)
    alone = numbers['figure 6']['pairs all, 3 objects']['alone']
    assert alone['end, pool, out of view'] == [None]
    assert 0 <= alone['end, pool, in view'][0] <= 1
