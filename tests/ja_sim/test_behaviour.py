"""When a trial begins, and when it does not."""

import math

import numpy as np
import pytest

from ja_sim.core.behaviour import ROBOT, Blinking, CaregiverBehaviour
from ja_sim.core.specs import CaregiverSpec

ON_HER, AWAY, STILL, FAST = 0.0, math.radians(20.0), 0.0, 3.0


def behaviour(**settings) -> CaregiverBehaviour:
    return CaregiverBehaviour(CaregiverSpec(**settings), np.random.default_rng(1))


def test_she_looks_at_the_robot_until_it_looks_at_her():
    caregiver = behaviour()
    assert not caregiver.update(0.0, AWAY, STILL, 5)
    assert caregiver.attends_to(0.0) == ROBOT
    assert caregiver.update(0.1, ON_HER, STILL, 5)
    assert caregiver.attends_to(0.1) in range(5)
    assert caregiver.response.trial == 1


def test_a_passing_glance_is_no_look():
    caregiver = behaviour()
    assert not caregiver.update(0.0, ON_HER, FAST, 5)
    assert caregiver.response.trial == 0


def test_one_look_counts_once_until_the_robot_has_left_her():
    caregiver = behaviour(eye_contact_deg=4.0)
    assert caregiver.update(0.0, ON_HER, STILL, 5)
    assert not caregiver.update(0.1, ON_HER, STILL, 5)
    # Out of the circle but not away: a head that trembles at its rim does not start trials.
    assert not caregiver.update(0.2, math.radians(5.0), STILL, 5)
    assert not caregiver.update(0.3, ON_HER, STILL, 5)
    assert not caregiver.update(0.4, AWAY, STILL, 5)
    assert caregiver.update(0.5, ON_HER, STILL, 5)
    assert caregiver.response.trial == 2


def test_she_attends_to_another_object_each_time():
    caregiver = behaviour()
    attended = []
    for trial in range(30):
        caregiver.update(trial, AWAY, STILL, 3)
        caregiver.update(trial + 0.5, ON_HER, STILL, 3)
        attended.append(caregiver.response.attended)
    assert all(a != b for a, b in zip(attended[1:], attended, strict=False))
    assert set(attended) == {0, 1, 2}


def test_one_object_may_be_attended_to_again():
    caregiver = behaviour()
    for trial in range(3):
        caregiver.update(trial, AWAY, STILL, 1)
        assert caregiver.update(trial + 0.5, ON_HER, STILL, 1)
        assert caregiver.response.attended == 0


def test_stared_at_too_long_she_looks_back_and_then_tries_another_object():
    caregiver = behaviour(patience_s=2.0, reaction_s=0.2, turn_s=0.3)
    caregiver.update(0.0, ON_HER, STILL, 5)
    first = caregiver.response.attended
    assert caregiver.attends_to(1.9) == first
    assert not caregiver.update(2.1, ON_HER, STILL, 5)
    assert caregiver.attends_to(2.1) == ROBOT
    assert caregiver.update(2.6, ON_HER, STILL, 5)
    assert caregiver.response.trial == 2
    assert caregiver.response.attended != first


def test_left_alone_she_attends_for_a_while_only():
    caregiver = behaviour(patience_s=1.0, attention_s=5.0)
    caregiver.update(0.0, ON_HER, STILL, 5)
    caregiver.update(0.5, AWAY, STILL, 5)
    assert caregiver.attends_to(4.9) == caregiver.response.attended
    assert caregiver.attends_to(5.1) == ROBOT


def test_her_eyes_miss_by_their_deviation_and_not_at_all_without_it():
    caregiver, errors = behaviour(gaze_noise_deg=2.0), []
    for trial in range(400):
        caregiver.update(trial, AWAY, STILL, 3)
        caregiver.update(trial + 0.5, ON_HER, STILL, 3)
        errors.append(caregiver.response.gaze_error_rad)
    np.testing.assert_allclose(np.degrees(np.std(errors, axis=0)), [2.0, 2.0], rtol=0.15)
    exact = behaviour(gaze_noise_deg=0.0)
    exact.update(0.0, ON_HER, STILL, 3)
    assert exact.response.gaze_error_rad == (0.0, 0.0)


def test_reliability_is_the_share_of_looks_that_go_where_she_attends():
    caregiver = behaviour(reliability=0.7)
    reliable = []
    for trial in range(1000):
        caregiver.update(trial, AWAY, STILL, 5)
        caregiver.update(trial + 0.5, ON_HER, STILL, 5)
        reliable.append(caregiver.response.reliable)
    assert np.mean(reliable) == pytest.approx(0.7, abs=0.05)


def test_head_share_is_drawn_per_look_within_its_range():
    caregiver = behaviour(head_share=(0.6, 0.9))
    shares = []
    for trial in range(500):
        caregiver.update(trial, AWAY, STILL, 5)
        caregiver.update(trial + 0.5, ON_HER, STILL, 5)
        shares.append(caregiver.response.head_share)
    assert 0.6 <= min(shares) < 0.62
    assert 0.88 < max(shares) <= 0.9


def test_blinks_come_at_their_rate_and_last_a_moment():
    blinking = Blinking(0.5, np.random.default_rng(0))
    closed = [blinking.lids_closed(t) for t in np.arange(0.0, 1000.0, 0.01)]
    blinks = np.sum(np.diff(np.array(closed, int)) == 1)
    assert blinks / 1000.0 == pytest.approx(1 / (2.0 + Blinking.CLOSED_S), rel=0.15)
    assert np.mean(closed) == pytest.approx(blinks * Blinking.CLOSED_S / 1000.0, rel=0.05)
    assert not any(Blinking(0.0, np.random.default_rng(0)).lids_closed(t) for t in (0.0, 1e6))
