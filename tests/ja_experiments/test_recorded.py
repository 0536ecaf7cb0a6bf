"""Experiments on recorded data sets of trials, in place of rendered looks."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ja_common.core.config import ConfigError
from ja_experiments.datasets.looks import Looks
from ja_experiments.datasets.recorded import places_around, recorded_materials
from ja_experiments.paper.experiment import Plan
from ja_experiments.paper.report import write_report
from ja_experiments.paper.study import StudyConfig, run_study
from ja_experiments.progress_bars import ProgressBars
from ja_recording.core.dataset import TrialSample, write_dataset
from ja_sim.core.specs import ObjectsSpec
from synthetic_trials import synthetic_samples


@pytest.fixture
def samples() -> list[TrialSample]:
    return synthetic_samples()


def test_looks_are_learned_from_in_their_order(
    tmp_path: Path, samples: list[TrialSample], looks: Looks
) -> None:
    folder = write_dataset(tmp_path / 'data', samples, (), '').parent
    materials = recorded_materials(folder, 0, 'default')
    assert (len(materials.pool), len(materials.fresh)) == (100, 25)
    np.testing.assert_array_equal(materials.pool.faces, looks.faces[:100])
    np.testing.assert_array_equal(materials.fresh.directions, looks.directions[100:])
    assert '125 by the truth of a simulation' in materials.origin
    assert len(recorded_materials(folder, 120, 'default').pool) == 120
    with pytest.raises(ConfigError, match='left to test on'):
        recorded_materials(folder, 124, 'default')


def test_without_truth_the_fixated_object_is_taken_for_the_attended_one(
    tmp_path: Path, samples: list[TrialSample], looks: Looks
) -> None:
    real = [replace(sample, attended_direction=None, joint_attention=None) for sample in samples]
    materials = recorded_materials(
        write_dataset(tmp_path / 'real', real, (), '').parent, 0, 'default'
    )
    np.testing.assert_array_equal(materials.pool.directions, looks.directions[:100] + 0.1)
    assert 'which may be another object' in materials.origin


def test_objects_are_placed_around_the_recorded_looks(places: ObjectsSpec) -> None:
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
    """The recorded person never attends to anything out of view."""
    seen = [
        s
        for s in samples
        if (np.abs(s.attended_direction - s.trial.postures[0]) < (0.28, 0.2)).all()
    ]
    folder = write_dataset(tmp_path / 'data', seen, (), '').parent
    config = StudyConfig(
        plan=Plan(trials=3000, seeds=(0,), test_trials=200), data=str(folder), pool=15
    )
    path = write_report(run_study(config, ProgressBars()), tmp_path / 'report')
    text = path.read_text()
    assert f'15 recorded looks of {len(seen)} (`data`)' in text
    assert f'{len(seen) - 15} other looks' in text
    assert 'Figure 7' not in text
    assert 'made the pictures: not known' in text
    assert (path.parent / 'figure-6b.png').exists()
    numbers = json.loads((path.parent / 'results.json').read_text(), parse_constant=pytest.fail)
    alone = numbers['figure 6']['pairs all, 3 objects']['alone']
    assert alone['end, pool, out of view'] == [None]
    assert 0 <= alone['end, pool, in view'][0] <= 1
