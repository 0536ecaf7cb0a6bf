"""The fast learner in the loop: its gate, its glances, and a world that changes.

One run for each seed, each with another caregiver, in the geometry of the default scene. The look
of a trial is one of 850, drawn with replacement. Only what the head has seen is a candidate, and
what it sees depends on the proposals that the gate chooses.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ja_benchmarks.learner_alone import LOOKS, next_seed, render_looks
from ja_benchmarks.rows import Row, success_row
from ja_experiments.agents.trial_loop import TrialLoop
from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.looks import LooksOrder, load_looks
from ja_experiments.processes import run_in_processes
from ja_learning.core.gaze_line import GazeLineLearner
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_sim.core.scene import load_scene

SEEDS = range(10, 15)
TRIALS, LAST = 400, 100
OBJECTS = (1, 3, 5, 10)
BEFORE_CHANGE = 200

_BASE = {
    # A glance lasts for one image, a fixation for two.
    'hold_s': 0.05,
    'fixation_wait_s': 0.05,
    'look_around': 'both_sides',
}
_DEFAULT_GATE = 'expected gain'
GATES: dict[str, dict[str, Any]] = {
    _DEFAULT_GATE: {'gating': 'expected_gain'},
    'evidence': {'gating': 'evidence'},
    # The paper's gate, with a centre and a slope for so quick a learner.
    'sigmoid': {
        'gating': 'sigmoid', 'sigmoid_centre_trials': 100.0, 'sigmoid_slope_trials': 15.0,
    },
}  # fmt: skip
# With fewer objects the gates hardly differ.
_COMPARED_WITH = (5, 10)


@dataclass(frozen=True)
class RunOutcome:
    """The results of one run: success and p(LM) of every trial, and images a trial."""

    success: np.ndarray
    p_lm: np.ndarray
    images_a_trial: float

    @property
    def opened(self) -> float:
        """Return the trials until p(LM) exceeded 0.5; all trials if it never did."""
        return float(np.argmax(self.p_lm > 0.5)) if (self.p_lm > 0.5).any() else len(self.p_lm)


def run() -> dict[str, Row]:
    """Measure gates, ablations and changes: means over seeds with their intervals."""
    render_looks(LooksOrder('default', seed, LOOKS) for seed in SEEDS)
    return _gates() | _ablation() | _changes()


def run_once(settings: dict[str, Any], top_down: bool, seed: int, change: str = '') -> RunOutcome:
    """Run one seed with these settings; after `BEFORE_CHANGE` trials the world may change."""
    config = ExperimentConfig().with_settings({**_BASE, **settings})
    learner = GazeLineLearner(GazeLineConfig(top_down=top_down), seed)
    looks = load_looks('default', seed, LOOKS)
    loop = TrialLoop(config, load_scene('default').objects, looks, learner, seed)
    before = loop.run(BEFORE_CHANGE).success
    if change == 'mirrored':
        loop.move_to(replace(looks, faces=np.ascontiguousarray(looks.faces[:, :, ::-1])))
    elif change == 'another caregiver':
        loop.move_to(load_looks('default', next_seed(SEEDS, seed), LOOKS))
    after = loop.run(TRIALS - BEFORE_CHANGE).success
    return RunOutcome(np.concatenate([before, after]), np.array(loop.p_lm), loop.images / TRIALS)


def _gates() -> dict[str, Row]:
    conditions = [
        (gate, objects)
        for objects in OBJECTS
        for gate in GATES
        if gate == _DEFAULT_GATE or objects in _COMPARED_WITH
    ]
    tasks = [
        ({**GATES[gate], 'objects': objects}, True, seed)
        for gate, objects in conditions
        for seed in SEEDS
    ]
    runs = _by_condition(run_in_processes('gates', run_once, tasks))
    rows: dict[str, Row] = {}
    for (gate, objects), found in zip(conditions, runs, strict=True):
        name = f'{objects} objects, gate: {gate}'
        rows |= _success(name, found)
        if gate != 'sigmoid':
            rows[f'{name}: opened after'] = _number([each.opened for each in found], 'trials')
    return rows


def _ablation() -> dict[str, Row]:
    # With both it is the condition of 5 objects above.
    conditions = [('off', False), ('off', True), ('both_sides', False)]
    tasks = [
        ({**GATES[_DEFAULT_GATE], 'look_around': around}, top_down, seed)
        for around, top_down in conditions
        for seed in SEEDS
    ]
    runs = _by_condition(run_in_processes('ablation', run_once, tasks))
    rows: dict[str, Row] = {}
    for (around, top_down), found in zip(conditions, runs, strict=True):
        name = f'look around: {around}, top-down: {"on" if top_down else "off"}'
        rows |= _success(name, found)
        rows[f'{name}: opened after'] = _number([each.opened for each in found], 'trials')
        rows[f'{name}: cost'] = _number([each.images_a_trial for each in found], 'images a trial')
    return rows


def _changes() -> dict[str, Row]:
    kinds = ('mirrored', 'another caregiver')
    tasks = [(GATES[_DEFAULT_GATE], True, seed, kind) for kind in kinds for seed in SEEDS]
    runs = _by_condition(run_in_processes('changes', run_once, tasks))
    rows: dict[str, Row] = {}
    for kind, found in zip(kinds, runs, strict=True):
        at = BEFORE_CHANGE
        parts = {'50 trials before': slice(at - 50, at), 'first 50 after': slice(at, at + 50)}
        for part, trials in {**parts, 'last 50': slice(-50, None)}.items():
            shares = [each.success[trials].mean() for each in found]
            rows[f'{kind} after {at}, {part}'] = success_row(shares)
        lowest = [each.p_lm[at:].min() for each in found]
        rows[f'{kind} after {at}, lowest p(LM)'] = _number(lowest, 'p(LM)')
    return rows


def _success(name: str, runs: list[RunOutcome]) -> dict[str, Row]:
    return {
        f'{name}: whole run': success_row([each.success.mean() for each in runs]),
        f'{name}: last {LAST}': success_row([each.success[-LAST:].mean() for each in runs]),
    }


def _by_condition(runs: list[RunOutcome]) -> list[list[RunOutcome]]:
    count = len(SEEDS)
    return [runs[start : start + count] for start in range(0, len(runs), count)]


def _number(values: list[float], unit: str) -> Row:
    spread = [float(min(values)), float(max(values))]
    return {'value': float(np.mean(values)), 'unit': unit, 'n': len(values), 'interval': spread}
