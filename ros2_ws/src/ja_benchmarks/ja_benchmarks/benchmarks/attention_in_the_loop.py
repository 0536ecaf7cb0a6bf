"""The fast learner in the loop: its gate, its glances, and a world that changes.

One life a seed, each with another caregiver and a fresh look every trial, in the geometry of the
default scene: what the head has not seen is no candidate, and what it sees depends on whom the
gate lets turn it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ja_benchmarks.benchmarks.learning_speed import LOOKS
from ja_benchmarks.rows import Row, success_row
from ja_experiments.agents.trial_loop import TrialLoop
from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.looks import load_looks
from ja_experiments.processes import side_by_side
from ja_learning.core.gaze_line import GazeLineLearner
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_sim.core.scene import load_scene

SEEDS = range(5)
TRIALS, LAST = 400, 100
OBJECTS = (1, 3, 5, 10)
BEFORE_CHANGE = 200

_BASE = {
    # A glance lasts for one image, a fixation for two.
    'hold_s': 0.05,
    'fixation_wait_s': 0.05,
    'look_around': 'both_sides',
}
GATES: dict[str, dict[str, Any]] = {
    'evidence': {'gating': 'evidence'},
    'sigmoid, centre 100': {
        'gating': 'sigmoid', 'sigmoid_centre_trials': 100.0, 'sigmoid_slope_trials': 15.0,
    },
}  # fmt: skip


@dataclass(frozen=True)
class Lived:
    """What came of one life: success and p(LM) of every trial, and images a trial."""

    success: np.ndarray
    p_lm: np.ndarray
    images_a_trial: float

    @property
    def opened(self) -> float:
        """Trials until p(LM) was beyond a half; as many as there were if it never was."""
        return float(np.argmax(self.p_lm > 0.5)) if (self.p_lm > 0.5).any() else len(self.p_lm)


def run() -> dict[str, Row]:
    """Means over seeds and their 95 % intervals."""
    for seed in SEEDS:
        load_looks('default', seed, LOOKS)
    return _gates() | _ablation() | _changes()


def live(settings: dict[str, Any], top_down: bool, seed: int, change: str = '') -> Lived:
    """One life under these settings; after `BEFORE_CHANGE` trials the world may change."""
    config = ExperimentConfig().with_settings({**_BASE, **settings})
    learner = GazeLineLearner(GazeLineConfig(top_down=top_down), seed)
    looks = load_looks('default', seed, LOOKS)
    life = TrialLoop(config, load_scene('default').objects, looks, learner, seed)
    before = life.run(BEFORE_CHANGE).success
    if change == 'mirrored':
        life.move_to(replace(looks, faces=np.ascontiguousarray(looks.faces[:, :, ::-1])))
    elif change == 'another caregiver':
        life.move_to(load_looks('default', (seed + 1) % len(SEEDS), LOOKS))
    after = life.run(TRIALS - BEFORE_CHANGE).success
    return Lived(np.concatenate([before, after]), np.array(life.p_lm), life.images / TRIALS)


def _gates() -> dict[str, Row]:
    conditions = [(gate, objects) for objects in OBJECTS for gate in GATES]
    tasks = [
        ({**GATES[gate], 'objects': objects}, True, seed)
        for gate, objects in conditions
        for seed in SEEDS
    ]
    lives = _by_condition(side_by_side('gates', live, tasks))
    rows: dict[str, Row] = {}
    for (gate, objects), found in zip(conditions, lives, strict=True):
        name = f'{objects} objects, gate: {gate}'
        rows |= _success(name, found)
        if gate == 'evidence':
            rows[f'{name}: opened after'] = _number([life.opened for life in found], 'trials')
    return rows


def _ablation() -> dict[str, Row]:
    conditions = [
        (around, top_down)
        for around in ('off', 'where_worthwhile', 'both_sides')
        for top_down in (False, True)
    ]
    tasks = [
        ({'gating': 'evidence', 'look_around': around}, top_down, seed)
        for around, top_down in conditions
        for seed in SEEDS
    ]
    lives = _by_condition(side_by_side('ablation', live, tasks))
    rows: dict[str, Row] = {}
    for (around, top_down), found in zip(conditions, lives, strict=True):
        name = f'look around: {around}, top-down: {"on" if top_down else "off"}'
        rows |= _success(name, found)
        rows[f'{name}: opened after'] = _number([life.opened for life in found], 'trials')
        rows[f'{name}: cost'] = _number([life.images_a_trial for life in found], 'images a trial')
    return rows


def _changes() -> dict[str, Row]:
    kinds = ('mirrored', 'another caregiver')
    tasks = [({'gating': 'evidence'}, True, seed, kind) for kind in kinds for seed in SEEDS]
    lives = _by_condition(side_by_side('changes', live, tasks))
    rows: dict[str, Row] = {}
    for kind, found in zip(kinds, lives, strict=True):
        at = BEFORE_CHANGE
        parts = {'50 trials before': slice(at - 50, at), 'first 50 after': slice(at, at + 50)}
        for part, trials in {**parts, 'last 50': slice(-50, None)}.items():
            shares = [life.success[trials].mean() for life in found]
            rows[f'{kind} after {at}, {part}'] = success_row(shares)
        lowest = [life.p_lm[at:].min() for life in found]
        rows[f'{kind} after {at}, lowest p(LM)'] = _number(lowest, 'p(LM)')
    return rows


def _success(name: str, lives: list[Lived]) -> dict[str, Row]:
    return {
        f'{name}: whole life': success_row([life.success.mean() for life in lives]),
        f'{name}: last {LAST}': success_row([life.success[-LAST:].mean() for life in lives]),
    }


def _by_condition(lives: list[Lived]) -> list[list[Lived]]:
    count = len(SEEDS)
    return [lives[start : start + count] for start in range(0, len(lives), count)]


def _number(values: list[float], unit: str) -> Row:
    spread = [float(min(values)), float(max(values))]
    return {'value': float(np.mean(values)), 'unit': unit, 'n': len(values), 'interval': spread}
