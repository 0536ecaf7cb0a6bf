"""Gating functions (Fig. 6 (a)): probability p(LM) that a shift follows the learning module."""

import math
from dataclasses import dataclass

from ja_common.core.config import parameter


@dataclass(frozen=True)
class GatingConfig:
    """Which gating function, and its numbers."""

    gating: str = parameter(
        'sigmoid', 'gating function of the trials so far', choices=('sigmoid', 'constant')
    )
    sigmoid_centre_trials: float = parameter(
        12e4, 'trials after which the sigmoid is at half its maximum', low=0.0
    )
    sigmoid_slope_trials: float = parameter(
        3e4, 'trials by which the argument of the sigmoid grows by one', low=1e-3
    )
    p_lm_max: float = parameter(
        1.0, 'maximum of the sigmoid, and the value of the constant', low=0.0, high=1.0
    )


class Gating:
    """p(LM) as a function of the number of finished trials."""

    def __init__(self, config: GatingConfig) -> None:
        self._config = config

    def p_lm(self, trials: int) -> float:
        """Probability, 0-1, that the next shift takes the learner's proposal."""
        c = self._config
        if c.gating == 'constant':
            return c.p_lm_max
        argument = (trials - c.sigmoid_centre_trials) / c.sigmoid_slope_trials
        # The logistic function, written so that it cannot overflow.
        return c.p_lm_max * 0.5 * (1 + math.tanh(argument / 2))
