"""The trapezoid: as fast as the limits allow, to the target, and never past it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ja_control.core.motion_profile import MotionProfile, stopping_speed

PERIOD_S, SPEED, ACCELERATION = 0.01, 2.0, 40.0


def run(profile, target, periods):
    """Return positions and velocities over so many periods, each (periods,)."""
    states = []
    for _ in range(periods):
        profile.approach(target)
        states.append((profile.position, profile.velocity))
    return np.array(states).T


@given(st.floats(1e-6, 10.0), st.floats(1e-3, 5.0), st.floats(1e-3, 0.1))
def test_braking_from_the_stopping_speed_ends_exactly_at_the_distance(distance, step, period_s):
    velocity, way = stopping_speed(distance, step, period_s), 0.0
    while velocity > 0.0:
        way += velocity * period_s
        velocity -= step
    assert way == pytest.approx(distance)


def test_it_takes_the_time_of_a_trapezoid_and_stands_at_the_target():
    positions, velocities = run(MotionProfile(PERIOD_S, SPEED, ACCELERATION), 1.0, 80)
    ideal_s = 1.0 / SPEED + SPEED / ACCELERATION
    arrived = np.flatnonzero(np.isclose(positions, 1.0, atol=1e-12))[0]
    assert (arrived + 1) * PERIOD_S == pytest.approx(ideal_s, abs=2 * PERIOD_S)
    assert positions.max() <= 1.0 + 1e-12
    assert velocities.max() == SPEED
    assert np.abs(np.diff(velocities)).max() <= ACCELERATION * PERIOD_S + 1e-12
    assert velocities[-1] == 0.0


def test_it_names_the_limit_that_cut_it():
    profile = MotionProfile(PERIOD_S, SPEED, ACCELERATION)
    limits = [profile.approach(1.0) for _ in range(80)]
    assert limits[0] == 'acceleration'
    assert limits[20] == 'speed'
    assert limits[-1] == ''


def test_target_that_jumps_back_is_passed_and_returned_to():
    profile = MotionProfile(PERIOD_S, SPEED, ACCELERATION)
    run(profile, 1.0, 20)
    here, speed = profile.position, profile.velocity
    positions, velocities = run(profile, here, 60)
    assert positions.max() - here == pytest.approx(speed**2 / 2 / ACCELERATION, abs=0.02)
    assert positions[-1] == pytest.approx(here)
    assert np.abs(np.diff(velocities)).max() <= ACCELERATION * PERIOD_S + 1e-12


def test_braking_stops_within_the_acceleration():
    profile = MotionProfile(PERIOD_S, SPEED, ACCELERATION)
    run(profile, 1.0, 20)
    for _ in range(round(SPEED / ACCELERATION / PERIOD_S)):
        assert profile.velocity > 0.0
        profile.brake()
    assert profile.velocity == 0.0


@pytest.mark.parametrize('target', [np.nan, np.inf, -np.inf])
def test_a_target_that_is_not_finite_brakes(target):
    profile = MotionProfile(PERIOD_S, SPEED, ACCELERATION)
    run(profile, 1.0, 20)
    positions, velocities = run(profile, target, 10)
    assert np.isfinite(positions).all()
    assert np.all(np.diff(velocities) <= 0.0)
    assert velocities[-1] == 0.0
