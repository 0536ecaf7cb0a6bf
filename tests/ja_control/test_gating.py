"""Fig. 6 (a): the rate at which the learning module is selected."""

import math

import pytest

from ja_control.core.gating import Gating, GatingConfig


def test_sigmoid_of_the_paper():
    gating = Gating(GatingConfig(sigmoid_centre_trials=12e4, sigmoid_slope_trials=3e4))
    assert gating.p_lm(120_000) == pytest.approx(0.5)
    assert gating.p_lm(150_000) == pytest.approx(0.7310586)  # 1 / (1 + 1/e)
    assert gating.p_lm(0) == pytest.approx(0.0179862)  # 1 / (1 + e^4)
    assert gating.p_lm(300_000) == pytest.approx(0.9975274)


def test_sigmoid_grows_and_stays_within_its_limits():
    gating = Gating(GatingConfig(p_lm_max=0.8))
    values = [gating.p_lm(trials) for trials in range(0, 400_000, 10_000)]
    assert values == sorted(values)
    assert gating.p_lm(120_000) == pytest.approx(0.4)
    assert gating.p_lm(10**12) == pytest.approx(0.8)


def test_step_so_steep_that_the_exponential_would_overflow():
    gating = Gating(GatingConfig(sigmoid_centre_trials=1e9, sigmoid_slope_trials=1e-3))
    assert gating.p_lm(0) == 0.0
    assert gating.p_lm(2 * 10**9) == 1.0


def test_constant():
    gating = Gating(GatingConfig(gating='constant', p_lm_max=0.3))
    assert gating.p_lm(0) == gating.p_lm(10**6) == 0.3


def test_evidence_opens_the_gate_and_closes_it_again():
    gating = Gating(GatingConfig(gating='evidence', evidence_centre_nats=3.0, p_lm_max=0.9))
    assert gating.p_lm(10**6, 3.0) == pytest.approx(0.45)
    assert gating.p_lm(0, 40.0) == pytest.approx(0.9), 'trials do not count'
    assert gating.p_lm(10**6, 0.0) == pytest.approx(0.9 / (1 + math.exp(3)))
    assert gating.p_lm(10**6, -1e6) == 0.0


def test_the_gate_follows_the_gain_that_can_be_expected():
    gating = Gating(GatingConfig(gating='expected_gain'))
    assert gating.p_lm(0, 0.0, 0.0) < 0.06, 'a learner that expects none is not asked'
    gains = [gating.p_lm(0, 0.0, gain / 20) for gain in range(21)]
    assert gains == sorted(gains)
    assert gains[-1] > 0.99
    assert gating.p_lm(10**6, 0.0, 0.4) == gating.p_lm(0, 0.0, 0.4), 'trials do not count'


def test_evidence_against_the_learner_lowers_the_gain_that_is_expected():
    gating = Gating(GatingConfig(gating='expected_gain', belief_prior_nats=2.0))
    sure = [gating.p_lm(0, nats, 1.0) for nats in (5.0, -2.0, -4.0, -20.0)]
    assert sure == sorted(sure, reverse=True)
    assert sure[1] > 0.99, 'half of a sure gain is worth asking'
    assert sure[2] < 0.5
    assert sure[3] < 0.05
    assert gating.p_lm(0, -1e6, 1.0) == pytest.approx(gating.p_lm(0, 0.0, 0.0))


def test_a_learner_that_expects_nothing_is_asked_by_the_evidence():
    by_gain = Gating(GatingConfig(gating='expected_gain', evidence_centre_nats=3.0))
    by_evidence = Gating(GatingConfig(gating='evidence', evidence_centre_nats=3.0))
    for nats in (-5.0, 3.0, 8.0):
        assert by_gain.p_lm(0, nats, math.nan) == by_evidence.p_lm(0, nats)
