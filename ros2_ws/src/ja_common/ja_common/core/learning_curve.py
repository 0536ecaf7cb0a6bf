"""The success curve of a run: the outcome of every trial, and success rates with intervals."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ja_common.core.statistics import Rate


@dataclass(frozen=True)
class TrialRecord:
    """One scored trial. `p_lm`: probability, 0-1, that its shifts followed the learner.

    `stage`: part of the course that it belongs to; '' for none.
    """

    trial: int
    success: bool
    p_lm: float
    elapsed_s: float
    stage: str = ''


class LearningCurve:
    """Scored trials, in the order in which they ended."""

    def __init__(self) -> None:
        self.records: list[TrialRecord] = []
        self.stage = ''

    def record_trial(self, success: bool, p_lm: float, elapsed_s: float) -> None:
        """Record the outcome of the trial that has just ended."""
        number = len(self.records) + 1
        self.records.append(TrialRecord(number, success, p_lm, elapsed_s, self.stage))

    def trials_of_stage(self, stage: str) -> list[TrialRecord]:
        """Return the trials of one part of the course."""
        return [record for record in self.records if record.stage == stage]

    def rate(self, trials: slice = slice(None), stage: str | None = None) -> Rate:
        """Return the success rate of some of the trials, of one stage where one is named."""
        chosen = (self.records if stage is None else self.trials_of_stage(stage))[trials]
        return Rate(sum(record.success for record in chosen), len(chosen))

    def recent_rates(self, window: int) -> NDArray[np.float64]:
        """Return the success rate after every trial, (n,), over the last `window` of its stage."""
        successes = np.cumsum([0, *(record.success for record in self.records)])
        trials = np.arange(1, len(successes))
        stages = [record.stage for record in self.records]
        begins = [0, *(i for i in range(1, len(stages)) if stages[i] != stages[i - 1])]
        first = np.maximum(trials - window, np.repeat(begins, np.diff([*begins, len(stages)])))
        return (successes[trials] - successes[first]) / (trials - first)
