"""Let an entrant practise, test it alone, and state its success and how many trials it needed.

Tests ask a copy of the entrant about looks that it never practised on; nothing of a test reaches
it. Each mark of a task gives the mean over seeds with its 95 % interval. Trials to criterion are
those at which the mean success reaches the criterion, interpolated between marks. Their interval
ends where the upper and the lower end of the band of success reach it: the trials at which the
mean does not differ from the criterion. Where a curve does not reach it, that is the result.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_common.core.statistics import band_over_seeds
from ja_experiments.learning_tasks.baselines import find_entrant
from ja_experiments.learning_tasks.drawn_trials import (
    DrawnTrial,
    TrialSource,
    nearest_object,
    towards,
)
from ja_experiments.learning_tasks.entrant import (
    REWARDED,
    ActingEntrant,
    Entrant,
    EntryTrack,
    FrozenEntrant,
)
from ja_experiments.learning_tasks.stage_looks import LooksSource, rendered_looks, stage_looks
from ja_experiments.learning_tasks.task_table import ScoredTask, find_task
from ja_experiments.learning_tasks.trial_env import TrialEnv

CRITERION = 0.8
# Between the only two marks of a stage, before and after, nothing is interpolated.
_TOO_FEW_MARKS = 2


class EntrantScore(NamedTuple):
    """The success of an entrant at one seed: its track, and shares by stage and mark.

    `scale`: it has practised so many times more trials than the marks state.
    """

    track: str
    scale: int
    success: list[list[float]]


class ScoreRow(NamedTuple):
    """One figure of the benchmark, of one learner in one stage of one task.

    `quantity`: `success` after `trials`, or `trials to .80`, of which `trials` is the most that
    were measured. `value`, `low`, `high`: the figure and its 95 % interval over `seeds` seeds.
    None: not reached within `trials`.
    """

    learner: str
    track: str
    task: str
    stage: str
    quantity: str
    trials: int
    value: float | None
    low: float | None
    high: float | None
    seeds: int

    def __str__(self) -> str:
        """Return the figure with its interval for a table."""
        if self.quantity == 'success':
            return f'{self.value:.3f} ({self.low:.3f}-{self.high:.3f})'
        if self.value is None and self.low is None:
            return f'not reached within {self.trials}'
        low, value, high = (
            f'>{self.trials}' if each is None else f'{each:.0f}'
            for each in (self.low, self.value, self.high)
        )
        return f'{value} ({low} to {high})'


def score(
    name: str, task_name: str, seed: int, source: LooksSource = rendered_looks
) -> EntrantScore:
    """Return the success of one entrant at one seed, the seed of the caregiver and of the learner.

    Raises ConfigError when it practised for more or fewer trials than it was asked to.
    """
    task, entrant = find_task(task_name), find_entrant(name)(seed)
    track, scale = EntryTrack.parse(entrant.track), getattr(entrant, 'trials_scale', 1)
    env = TrialEnv(task.name, seed, str(track.senses), track.declared == REWARDED, scale, source)
    env.reset(seed=seed)
    tests = _tests(task, track, seed, source)
    success: list[list[float]] = []
    for marks, test in zip(task.stages, tests, strict=True):
        success.append([])
        for before, mark in zip((0, *marks), marks, strict=False):
            _practise(entrant, env, scale * (mark - before))
            success[-1].append(_success(copy.deepcopy(entrant), test))
    return EntrantScore(str(track), scale, success)


def _tests(
    task: ScoredTask, track: EntryTrack, seed: int, source: LooksSource
) -> list[list[DrawnTrial]]:
    """Return the trials of the test of each stage, the same for every entrant."""
    trials = TrialSource(task, track.senses)
    return [
        list(trials.test_trials(np.random.default_rng([seed, task.objects, stage]), looks.test))
        for stage, looks in enumerate(stage_looks(task, seed, source))
    ]


def _practise(entrant: Entrant, env: TrialEnv, trials: int) -> None:
    if not trials:
        return
    end = env.trials + trials
    if isinstance(entrant, ActingEntrant):
        entrant.practise(env, trials)
        if env.trials != end:
            raise ConfigError(f'the entrant practised for {env.trials} trials in place of {end}')
        return
    for _ in range(trials):
        observation, _ = env.reset()
        action = towards(observation, int(np.argmax(observation['salience'])))
        *_, info = env.step(action)
        entrant.learn(observation, info['fixated'])


def _success(entrant: FrozenEntrant, test: Sequence[DrawnTrial]) -> float:
    """Return how often the object nearest to its aim is the attended one, 0-1."""
    right = [
        nearest_object(observation, entrant.propose(observation)) == attended
        for observation, attended in test
    ]
    return float(np.mean(right))


def score_rows(learner: str, task_name: str, scores: Sequence[EntrantScore]) -> Iterator[ScoreRow]:
    """Yield the rows of one learner in one task, from its scores at all seeds."""
    task, track, scale = find_task(task_name), scores[0].track, scores[0].scale
    for stage, marks in enumerate(task.stages):
        curves = np.array([each.success[stage] for each in scores])
        band = band_over_seeds(curves)
        trials = scale * np.array(marks)
        place = (learner, track, task_name, f'after the change: {task.change}' * stage or 'first')
        for index, after in enumerate(trials):
            mean, low, high = (float(line[index]) for line in band)
            yield ScoreRow(*place, 'success', int(after), mean, low, high, len(scores))
        if len(marks) <= _TOO_FEW_MARKS:
            continue
        reached, last, first = (first_reached(trials, line) for line in band)
        quantity = f'trials to {CRITERION:.2f}'.replace('0.', '.')
        yield ScoreRow(*place, quantity, int(trials[-1]), reached, first, last, len(scores))


def first_reached(
    trials: NDArray[np.int64], success: NDArray[np.float64], criterion: float = CRITERION
) -> float | None:
    """Return the trials, interpolated, at which success (n,) reaches a criterion; None: never."""
    reached = np.flatnonzero(success >= criterion)
    if not reached.size:
        return None
    index = int(reached[0])
    if index == 0:
        return float(trials[0])
    around = slice(index - 1, index + 1)
    return float(np.interp(criterion, success[around], trials[around]))
