"""Run conditions of the experiment over several seeds: learning, with tests in between.

Online success is the success of the robot while it learns, with the current gate. The learner
alone is tested separately: it does not learn, and every shift follows the network, on looks of the
pool and on fresh ones.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from functools import cached_property
from threading import Event

import numpy as np
from numpy.typing import NDArray

from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.looks import POOL, Looks
from ja_experiments.paper.kernel import FastExperiment, PreparedLooks, prepare
from ja_experiments.paper.outcomes import Outcomes
from ja_learning.core.network import ThreeLayerNetwork
from ja_sim.core.specs import ObjectsSpec

TRIALS = 300_000
SEEDS = 10
BLOCKS = 30
STAGES = {'I': 2, 'II': 12, 'III': 27}
"""The blocks, of 10^4 trials each, that Figure 6 shows: 2-3, 12-13 and 27-28 x 10^4."""
LEARNER_ALONE = {'gating': 'constant', 'p_lm_max': 1.0}
_TEST_SEED = 1_000_000


@dataclass(frozen=True)
class Materials:
    """What all runs share: looks to learn from and to test on, and the ranges of the objects.

    `origin`: the source of the looks, as a sentence for the report.
    """

    pool: Looks
    fresh: Looks
    places: ObjectsSpec
    origin: str = ''

    @classmethod
    def from_looks(
        cls, looks: Looks, places: ObjectsSpec, origin: str = '', pool: int = POOL
    ) -> Materials:
        """Split looks: the first `pool` are learned from, the others are for tests."""
        return cls(looks[:pool], looks[pool:], places, origin)


@dataclass(frozen=True)
class Plan:
    """Number of trials in a run, seeds, and number of trials in a test."""

    trials: int = TRIALS
    seeds: tuple[int, ...] = tuple(range(SEEDS))
    test_trials: int = 2000

    @property
    def block(self) -> int:
        """Return the number of trials in a block."""
        return self.trials // BLOCKS

    def scale_gate(self, config: ExperimentConfig) -> ExperimentConfig:
        """Return the configuration with the gate's sigmoid scaled to the length of the run."""
        gating, share = config.gating, self.trials / TRIALS
        scaled = replace(
            gating,
            sigmoid_centre_trials=gating.sigmoid_centre_trials * share,
            sigmoid_slope_trials=gating.sigmoid_slope_trials * share,
        )
        return replace(config, gating=scaled)


@dataclass(frozen=True)
class Run:
    """The results of one seed.

    `alone`: outcomes of the learner alone, by stage (`I`, `II`, `III`, `end`) and by the looks
    tested on (`pool`, `fresh`). `explained`: (blocks, 2, 2), the share of the variance of the
    right commands that the network's answers explain after every block, for pool and fresh looks,
    in pan and tilt.
    """

    online: Outcomes
    alone: dict[str, dict[str, Outcomes]]
    explained: NDArray[np.float64]
    network: ThreeLayerNetwork


@dataclass(frozen=True)
class Condition:
    """The runs of one configuration."""

    config: ExperimentConfig
    plan: Plan
    runs: list[Run]

    @cached_property
    def curve(self) -> NDArray[np.float64]:
        """Return online success by seed and block, (seeds, blocks)."""
        success = np.array([run.online.success[: BLOCKS * self.plan.block] for run in self.runs])
        return success.reshape(len(self.runs), BLOCKS, self.plan.block).mean(axis=2)

    def online(self, block: int, in_view: bool | None = None) -> NDArray[np.float64]:
        """Return online success of every seed in one block, (seeds,).

        `in_view`: only trials whose attended object was in view of the look, or was not.
        """
        size = self.plan.block
        first = (block % BLOCKS) * size
        return _shares([run.online[first : first + size] for run in self.runs], in_view)

    def alone(self, stage: str, looks: str, in_view: bool | None = None) -> NDArray[np.float64]:
        """Return success of every seed's learner alone, (seeds,), after a stage.

        `looks`: `pool` or `fresh`; `in_view`: as in `online`.
        """
        return _shares([run.alone[stage][looks] for run in self.runs], in_view)


def _shares(outcomes: Sequence[Outcomes], in_view: bool | None) -> NDArray[np.float64]:
    chosen = [o.success if in_view is None else o.success[o.in_view == in_view] for o in outcomes]
    # A recorded person may never have attended to anything out of view.
    return np.array([success.mean() if len(success) else np.nan for success in chosen])


def run_conditions(
    configs: dict[str, ExperimentConfig],
    plan: Plan,
    materials: Materials,
    workers: int | None = None,
    progress: Callable[[int], None] = lambda trials: None,
) -> dict[str, Condition]:
    """Run every configuration with every seed of the plan, on all cores; return the conditions.

    The kernel releases the GIL, so threads suffice. `progress` receives, from any thread, the
    number of trials run since its last call. An error in it ends all runs and is raised.
    """
    results: dict[str, dict[int, Run]] = {name: {} for name in configs}
    stop = Event()

    def report_progress(trials: int) -> None:
        if stop.is_set():
            raise CancelledError
        progress(trials)

    with ThreadPoolExecutor(workers or os.cpu_count()) as threads:
        jobs = {
            threads.submit(run_seed, config, plan, materials, seed, report_progress): (name, seed)
            for name, config in configs.items()
            for seed in plan.seeds
        }
        try:
            for job in as_completed(jobs):
                name, seed = jobs[job]
                results[name][seed] = job.result()
        except BaseException:
            stop.set()
            threads.shutdown(wait=True, cancel_futures=True)
            raise
    return {
        name: Condition(config, plan, [results[name][seed] for seed in plan.seeds])
        for name, config in configs.items()
    }


def run_seed(
    config: ExperimentConfig,
    plan: Plan,
    materials: Materials,
    seed: int,
    progress: Callable[[int], None] = lambda trials: None,
) -> Run:
    """Run one seed: learn in blocks, measure the explained variance, test after each stage."""
    experiment = FastExperiment(plan.scale_gate(config), materials.places, materials.pool, seed)
    tested = {
        'pool': prepare(materials.pool, config),
        'fresh': prepare(materials.fresh, config),
    }
    # The caregiver of the tests is reliable: the tests measure the network, not the caregiver.
    test_config = config.with_settings({**LEARNER_ALONE, 'reliability': 1.0})
    online, alone, explained = [], {}, []
    for block in range(BLOCKS):
        online.append(experiment.run(plan.block))
        explained.append([_explained(experiment, looks) for looks in tested.values()])
        for stage in _stages_after(block):
            alone[stage] = {
                name: experiment.test(test_config, looks, plan.test_trials, _TEST_SEED + seed)
                for name, looks in tested.items()
            }
        progress(plan.block)
    return Run(_joined(online), alone, np.array(explained), experiment.network)


def _stages_after(block: int) -> list[str]:
    stages = {**STAGES, 'end': BLOCKS - 1}
    return [stage for stage, last in stages.items() if last == block]


def _explained(experiment: FastExperiment, looks: PreparedLooks) -> NDArray[np.float64]:
    """Return the explained share of the variance of the right commands, (2,): pan, tilt."""
    right = looks.directions - looks.postures
    wrong = experiment.predict(looks) - right
    return 1 - (wrong**2).mean(axis=0) / right.var(axis=0)


def _joined(parts: Sequence[Outcomes]) -> Outcomes:
    return Outcomes(
        np.concatenate([part.fixated for part in parts]),
        np.concatenate([part.in_view for part in parts]),
        np.concatenate([part.pan_rad for part in parts]),
        np.concatenate([part.shifts for part in parts]),
    )
