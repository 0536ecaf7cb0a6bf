"""One joint: its own samples, and a velocity that a driver only fills in."""

import pytest

from ja_common.core.joint_track import JointTrack

MS = 1_000_000


def track(*samples):
    """Return a track of (milliseconds, position, velocity) samples."""
    kept = JointTrack(2.0)
    for ms, position, velocity in samples:
        kept.record_sample(ms * MS, position, velocity)
    return kept


def moving(velocity, step=0.01, start_ms=0):
    return [(start_ms + 10 * i, step * i, velocity) for i in range(20)]


def test_a_velocity_that_stays_zero_in_motion_is_derived():
    kept = track(*moving(0.0))
    assert kept.ignores_velocity
    assert kept.newest.velocity == pytest.approx(1.0)


def test_the_first_velocity_other_than_zero_ends_that():
    kept = track(*moving(0.0), (200, 0.2, 0.9), (210, 0.2, 0.0))
    assert not kept.ignores_velocity
    assert kept.newest.velocity == 0.0


@pytest.mark.parametrize(
    'samples',
    [
        [(0, 0.0, 0.1), *moving(0.0, start_ms=10)],  # measured: it was other than 0 before
        [(10 * i, 0.1 * (i % 2), 0.0) for i in range(40)],  # an encoder that flickers
        moving(0.0, step=1e-4),  # a drift of 2 mrad
        [(0, 0.0, 0.0), (10, 1.0, 0.0), (20, 2.0, 0.0)],  # put there by hand, unseen
    ],
    ids=['measured', 'flickers', 'drifts', 'jumps'],
)
def test_a_head_that_stands_still_is_believed(samples):
    kept = track(*samples)
    assert not kept.ignores_velocity
    assert kept.newest.velocity == 0.0


@pytest.mark.parametrize(
    ('ms', 'why'),
    [
        (300, 'its newest position is 0.28 s older'),
        (-1000, 'its oldest position is 1 s newer'),
        (10, ''),
    ],
)
def test_why_a_joint_is_unknown(ms, why):
    assert track((0, 0.0, None), (20, 0.0, None)).why_unknown(ms * MS) == why


def test_why_a_joint_is_unknown_within_a_gap_and_before_all():
    assert 'more than 0.5 s apart' in track((0, 0.0, None), (900, 0.0, None)).why_unknown(400 * MS)
    assert track().why_unknown(0) == 'no position has come'
