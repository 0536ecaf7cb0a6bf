"""Does the whole graph learn? Three demos a learner, minutes each: `./ja test -m learning`."""

import csv
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import t

SEEDS = (1, 2, 3)


def learner_alone(learner: str, seed: int, folder: Path) -> dict[str, float]:
    """Return success rates of the learner alone in the exams of one demo."""
    # By trials, not by time, so that a busy machine gives as much practice.
    options = ['--learner', learner, '--seed', str(seed), '--time', '900']
    demo = [sys.executable, '-m', 'ja_bringup.cli', 'demo', *options]
    ran = subprocess.run(demo, cwd=folder, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    [path] = folder.glob('runs/*-demo/success_curve.csv')
    rows = list(csv.DictReader(path.open()))
    stages = ('exam before', 'exam after')
    return {
        stage: float(np.mean([int(row['success']) for row in rows if row['stage'] == stage]))
        for stage in stages
    }


def interval(values: NDArray[np.float64]) -> tuple[float, float]:
    """Return the 95 % interval of the mean over seeds (Student's t)."""
    half = t.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values))
    return values.mean() - half, values.mean() + half


@pytest.mark.learning
@pytest.mark.parametrize(('learner', 'objects'), [('gaze_line', 5), ('paper', 3)])
def test_the_learner_alone_beats_its_start_and_chance(learner, objects, domain, tmp_path):
    exams = []
    for seed in SEEDS:
        folder = tmp_path / str(seed)
        folder.mkdir()
        exams.append(learner_alone(learner, seed, folder))
    before = np.array([exam['exam before'] for exam in exams])
    after = np.array([exam['exam after'] for exam in exams])
    print(f'\n{learner} alone, before: {before}, after: {after}')
    assert interval(after - before)[0] > 0
    assert interval(after)[0] > 1 / objects
