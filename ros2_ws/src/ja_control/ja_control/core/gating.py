"""Gating functions: probability p(LM) that a shift follows the learning module.

The paper's sigmoid (Fig. 6 (a)) depends on the number of trials. Its future work asks for a gate
that depends on the robot's own performance: `evidence`.
"""

import math
from dataclasses import dataclass

from ja_common.core.config import Configuration, parameter


@dataclass(frozen=True)
class GatingConfig(Configuration):
    """The gating function and its numbers."""

    gating: str = parameter(
        'sigmoid',
        'p(LM) as a sigmoid of the trials so far, as a constant, or by the evidence that the '
        'learner does better than chance',
        choices=('sigmoid', 'constant', 'evidence'),
    )
    sigmoid_centre_trials: float = parameter(
        12e4, 'trials after which the sigmoid is at half its maximum', low=0.0
    )
    sigmoid_slope_trials: float = parameter(
        3e4, 'trials by which the argument of the sigmoid grows by one', low=1e-3
    )
    evidence_centre_nats: float = parameter(
        3.0,
        'log evidence at which p(LM) is at half its maximum: by chance it reaches 3 in less '
        'than one of exp(3) = 20 runs',
        low=-50.0, high=50.0,
    )  # fmt: skip
    p_lm_max: float = parameter(
        1.0, 'maximum of p(LM), and the value of the constant', low=0.0, high=1.0
    )


class Gating:
    """p(LM) as a function of the finished trials, or of the evidence for the learner."""

    def __init__(self, config: GatingConfig) -> None:
        self._config = config

    def p_lm(self, trials: int, log_evidence: float = 0.0) -> float:
        """Return the probability, 0-1, that the next shift takes the learner's proposal.

        `log_evidence` [nats]: log Bayes factor of 'the learner predicts better than chance'
        against 'chance'. With even prior odds and a centre of 0, p(LM) is the probability
        of the former.
        """
        c = self._config
        if c.gating == 'constant':
            return c.p_lm_max
        if c.gating == 'evidence':
            return c.p_lm_max * _logistic(log_evidence - c.evidence_centre_nats)
        argument = (trials - c.sigmoid_centre_trials) / c.sigmoid_slope_trials
        return c.p_lm_max * _logistic(argument)


def _logistic(argument: float) -> float:
    """1 / (1 + exp(-argument)), without overflow."""
    return 0.5 * (1 + math.tanh(argument / 2))
