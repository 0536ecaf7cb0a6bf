"""A short study, from configuration to report."""

import hashlib
import json
import math
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import yaml

from ja_common.core.statistics import over_seeds
from ja_experiments.config import READINGS, reading
from ja_experiments.datasets.looks import Looks
from ja_experiments.paper.experiment import BLOCKS, Materials, Plan, run_conditions
from ja_experiments.paper.report import write_report
from ja_experiments.paper.study import StudyConfig, read_ablations, run_study
from ja_experiments.progress_bars import ProgressBars
from ja_sim.core.specs import ObjectsSpec


@pytest.fixture
def materials(looks: Looks, places: ObjectsSpec) -> Materials:
    return Materials(looks[:100], looks[100:], places)


def test_the_interval_over_seeds_is_students() -> None:
    found = over_seeds([0.4, 0.5, 0.6])
    assert (found.mean, found.n) == (pytest.approx(0.5), 3)
    # t(0.975, 2) = 4.3027; the deviation is 0.1.
    assert found.high - found.mean == pytest.approx(4.3027 * 0.1 / math.sqrt(3), rel=1e-4)
    assert over_seeds([0.7]).low == 0.0


def test_shares_are_those_of_the_outcomes(materials: Materials) -> None:
    plan = Plan(trials=3000, seeds=(4, 2), test_trials=200)
    condition = run_conditions({'x': reading('all')}, plan, materials)['x']
    first = condition.runs[0].online
    assert len(first) == 3000
    assert condition.curve.shape == (2, BLOCKS)
    assert condition.curve[0, 3] == pytest.approx(first.success[300:400].mean())
    last = first[2900:]
    assert condition.online(-1, in_view=True)[0] == pytest.approx(
        last.success[last.in_view].mean()
    )
    alone = run_conditions({'x': reading('all')}, Plan(3000, (2,), 200), materials)['x']
    np.testing.assert_array_equal(alone.runs[0].online.fixated, condition.runs[1].online.fixated)


def test_progress_is_reported_and_an_error_in_it_ends_the_run(materials: Materials) -> None:
    reported: list[int] = []
    plan = Plan(trials=3000, seeds=(0, 1), test_trials=10)
    run_conditions({'x': reading('all')}, plan, materials, progress=reported.append)
    assert sum(reported) == 6000

    def fail(_: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_conditions({'x': reading('all')}, plan, materials, progress=fail)


def test_every_ablation_changes_something() -> None:
    base = reading('all').with_settings({'objects': 5})
    last = reading('last').with_settings({'objects': 5})
    for name, settings in read_ablations().items():
        changed = [config.with_settings(settings) != config for config in (base, last)]
        assert any(changed) == (name != 'as it stands'), name


def test_a_study_becomes_a_report(tmp_path: Path, materials: Materials) -> None:
    config = StudyConfig(
        plan=Plan(trials=3000, seeds=(0, 1), test_trials=200),
        values='chosen',
        episodes=3,
        ablation_seeds=1,
    )
    path = write_report(run_study(config, ProgressBars(), materials), tmp_path / 'report')

    text = path.read_text()
    pictures = {line.split('](')[1].rstrip(')') for line in text.splitlines() if '![' in line}
    assert {
        'figure-6a.png',
        'figure-6b.png',
        'figure-6c-all.png',
        'ablations-last.png',
    } <= pictures
    for name in pictures:
        assert (path.parent / name).read_bytes().startswith(b'\x89PNG')
    page = (path.parent / 'report.html').read_text()
    assert page.count('<table>') == text.count('\n| ---')
    numbers = json.loads((path.parent / 'results.json').read_text())
    curve = numbers['figure 6']['pairs all, 5 objects']['online, by seed and block']
    assert np.array(curve).shape == (2, BLOCKS)
    kept = yaml.safe_load((path.parent / 'config.yaml').read_text())
    assert kept['study']['plan']['seeds'] == [0, 1]
    assert 'are the *chosen* ones' in text
    for name in READINGS:
        chosen = reading(name, 'chosen').network
        assert kept['readings'][name]['initial_weight'] == chosen.initial_weight
        assert chosen != reading(name).network, 'the default is another set of values'
    shipped = (files('ja_perception.models') / 'blazeface_short_range.onnx').read_bytes()
    digest = hashlib.sha256(shipped).hexdigest()
    for named in (kept, numbers):
        assert named['track'] == 'strict'
        assert named['weight_files'] == {'blazeface_short_range.onnx': digest}
    assert 'Track: *strict*' in text
    assert digest[:16] in text
    # The gate keeps its place: at 12 of 30 blocks.
    assert kept['readings']['all']['sigmoid_centre_trials'] == pytest.approx(1200)
