"""Intervals of shares: as scipy's."""

import numpy as np
import pytest
from scipy.stats import binomtest

from ja_common.core.statistics import Rate, wilson_interval


@pytest.mark.parametrize('trials', [1, 2, 7, 100, 5000])
def test_the_interval_of_a_share_is_that_of_scipy(trials):
    for successes in {0, 1, trials // 3, trials - 1, trials}:
        expected = binomtest(successes, trials).proportion_ci(method='wilson')
        np.testing.assert_allclose(wilson_interval(successes, trials), expected, atol=1e-12)


def test_a_rate_without_trials_is_unknown():
    assert Rate(0, 0).interval == (0.0, 1.0)
    assert str(Rate(0, 0)) == 'no trials'
