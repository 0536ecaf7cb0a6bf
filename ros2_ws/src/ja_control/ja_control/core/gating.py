"""Gating functions: probability p(LM) that a shift follows the learning module.

The paper's sigmoid (Fig. 6 (a)) depends on the number of trials. Its future work asks for a gate
that depends on the robot's own performance: `evidence`, and `expected_gain`.

A test against chance is late. Where the learner does no better than chance, nothing is lost by
asking it, for visual feedback chooses by chance. What counts is the gain that can be expected: its
own, as it believes, times the probability that its belief is of any worth, which evidence against
it lowers.
"""

import math
from dataclasses import dataclass

from ja_common.core.config import Configuration, parameter

_GAIN_SLOPE = 0.05


@dataclass(frozen=True)
class GatingConfig(Configuration):
    """The gating function and its numbers."""

    gating: str = parameter(
        'sigmoid',
        'p(LM) as a sigmoid of the trials so far, as a constant, by the evidence that the learner '
        'does better than chance, or by the gain that can be expected of asking the learner (by '
        'the evidence where the learner expects none)',
        choices=('sigmoid', 'constant', 'evidence', 'expected_gain'),
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
    gain_centre: float = parameter(
        0.15,
        'expected gain at which p(LM) is at half its maximum: 0 for a choice by chance, 1 for one '
        'that is always right',
        low=0.0, high=1.0,
    )  # fmt: skip
    belief_prior_nats: float = parameter(
        2.0,
        'log prior odds that the belief of a learner is of any worth: so much evidence against it '
        'halves the gain that is expected',
        low=-50.0, high=50.0,
    )  # fmt: skip
    p_lm_max: float = parameter(
        1.0, 'maximum of p(LM), and the value of the constant', low=0.0, high=1.0
    )


class Gating:
    """p(LM) as a function of the finished trials, or of the evidence for the learner."""

    def __init__(self, config: GatingConfig) -> None:
        self._config = config

    def p_lm(
        self, trials: int, log_evidence: float = 0.0, expected_gain: float = math.nan
    ) -> float:
        """Return the probability, 0-1, that the next shift takes the learner's proposal.

        `log_evidence` [nats]: log Bayes factor of 'the learner predicts better than chance'
        against 'chance'. With even prior odds and a centre of 0, p(LM) is the probability
        of the former. `expected_gain`: of the learner's choice over a choice by chance, 0-1, as
        the learner believes; NaN: it does not know.
        """
        c = self._config
        if c.gating == 'constant':
            return c.p_lm_max
        if c.gating == 'expected_gain' and not math.isnan(expected_gain):
            gain = _logistic(log_evidence + c.belief_prior_nats) * expected_gain
            return c.p_lm_max * _logistic((gain - c.gain_centre) / _GAIN_SLOPE)
        if c.gating in ('evidence', 'expected_gain'):
            return c.p_lm_max * _logistic(log_evidence - c.evidence_centre_nats)
        argument = (trials - c.sigmoid_centre_trials) / c.sigmoid_slope_trials
        return c.p_lm_max * _logistic(argument)


def _logistic(argument: float) -> float:
    """1 / (1 + exp(-argument)), without overflow."""
    return 0.5 * (1 + math.tanh(argument / 2))
