"""The posture at an image's stamp: interpolated, never the newest; no item waits for ever."""

import numpy as np
import pytest

from ja_common.core.posture import Posture, PostureHistory, PostureJoin
from ja_common.core.stamps import NS_PER_S

MS = 1_000_000


def history(*samples, **options):
    """Return a history of (milliseconds, pan) samples."""
    kept = PostureHistory(**options)
    for ms, pan in samples:
        kept.record_posture(ms * MS, (pan, 0.0))
    return kept


def test_posture_is_interpolated_at_the_stamp():
    kept = PostureHistory()
    kept.record_posture(100 * MS, (0.10, 0.0), (1.0, 0.0))
    kept.record_posture(120 * MS, (0.14, -0.2), (3.0, -4.0))
    at = kept.at(105 * MS)
    assert at.stamp_ns == 105 * MS
    assert at.position == pytest.approx((0.11, -0.05))
    assert at.velocity == pytest.approx((1.5, -1.0))
    assert kept.at(120 * MS).position == pytest.approx((0.14, -0.2))


@pytest.mark.parametrize('ms', [99, 121])
def test_nothing_is_extrapolated(ms):
    assert history((100, 0.1), (120, 0.2)).at(ms * MS) is None


def test_empty_history_knows_nothing():
    empty = PostureHistory()
    assert empty.newest is None
    assert empty.at(0) is None


def test_samples_out_of_order_are_put_in_order():
    kept = history((100, 0.0), (140, 0.4), (120, 0.1))
    assert kept.at(110 * MS).position[0] == pytest.approx(0.05)
    assert kept.at(130 * MS).position[0] == pytest.approx(0.25)
    assert kept.newest.stamp_ns == 140 * MS


def test_duplicates_are_dropped():
    kept = history((100, 0.0), (120, 0.2), (120, 9.0))
    assert kept.at(120 * MS).position[0] == pytest.approx(0.2)


def test_velocity_is_the_difference_where_none_is_measured():
    kept = history((100, 0.0), (120, 0.02))
    assert kept.newest.velocity == pytest.approx((1.0, 0.0))


def test_history_starts_again_when_the_clock_is_set_back():
    kept = history((10_000, 0.5), (10_100, 0.6), (1_000, 0.1), (1_100, 0.2), horizon_s=2.0)
    assert kept.newest.stamp_ns == 1_100 * MS
    assert kept.at(1_050 * MS).position[0] == pytest.approx(0.15)
    assert kept.at(10_050 * MS) is None


def test_history_forgets_what_is_older_than_its_horizon():
    kept = history((0, 0.0), (1_000, 0.1), (2_500, 0.2), horizon_s=2.0)
    assert kept.at(500 * MS) is None
    assert kept.at(1_000 * MS) is not None


@pytest.mark.parametrize('position', [(np.nan, 0), (0, np.inf), (0,), (0, 0, 0)])
def test_bad_sample_is_refused_and_nothing_added(position):
    kept = history((100, 0.0))
    with pytest.raises(ValueError, match='two finite numbers'):
        kept.record_posture(120 * MS, position)
    with pytest.raises(ValueError, match='joint velocity'):
        kept.record_posture(120 * MS, (0.0, 0.0), velocity=(np.nan, 0.0))
    assert kept.newest.stamp_ns == 100 * MS


def test_still_means_both_joints():
    posture = Posture(0, np.zeros(2), np.array([0.01, -0.2]))
    assert not posture.is_still(0.2)
    assert posture.is_still(0.21)


def test_joints_that_come_at_different_times_and_rates_are_interpolated_one_by_one():
    kept = PostureHistory()
    for ms in range(0, 200, 10):
        kept.record_joint(0, ms * MS, ms / 1000, 1.0)
    for ms in (5, 105):  # tilt ten times slower, without velocity
        kept.record_joint(1, ms * MS, -ms / 1000)
    at = kept.at(57 * MS)
    assert at.position == pytest.approx((0.057, -0.057))
    assert at.velocity == pytest.approx((1.0, -0.52))
    assert kept.at(106 * MS) is None, 'tilt is not known there yet'
    assert kept.newest.stamp_ns == 105 * MS, 'the older of the two'
    assert kept.newest.position == pytest.approx((0.105, -0.105))


def test_one_joint_alone_is_no_posture():
    kept = PostureHistory()
    kept.record_joint(0, 100 * MS, 0.1)
    assert kept.newest is None
    assert kept.at(100 * MS) is None
    assert kept.why_unknown(100 * MS) == ['', 'no position has come']
    kept.record_joint(1, 50 * MS, 0.2)
    assert kept.newest.stamp_ns == 50 * MS
    assert kept.newest.position == pytest.approx((0.1, 0.2))


def test_a_clock_set_back_for_one_joint_is_set_back_for_both():
    kept = history((10_000, 0.5), (10_100, 0.6))
    kept.record_joint(0, 1_000 * MS, 0.1)
    assert kept.newest is None
    kept.record_joint(1, 1_000 * MS, 0.1)
    assert kept.newest.stamp_ns == 1_000 * MS


def test_a_late_message_of_one_joint_leaves_the_other():
    kept = PostureHistory()
    for ms in (0, 20, 40):
        kept.record_joint(0, ms * MS, 0.0)
    for ms in (0, 40, 20):
        kept.record_joint(1, ms * MS, ms / 1000)
    assert kept.at(30 * MS).position == pytest.approx((0.0, 0.03))


def test_both_joints_in_one_message_give_what_the_pairs_give_bit_for_bit():
    """Trials recorded with the first releases are learned from again with the same outcome."""
    random = np.random.default_rng(5)
    stamps = np.cumsum(random.integers(1, 30, 200)) * MS
    positions, velocities = random.normal(size=(2, 200, 2))
    kept = PostureHistory(horizon_s=100.0)
    for stamp_ns, position, velocity in zip(stamps.tolist(), positions, velocities, strict=True):
        kept.record_posture(stamp_ns, position, velocity)
    for stamp_ns in random.integers(stamps[0] + 1, stamps[-1], 500).tolist():
        i = int(np.searchsorted(stamps, stamp_ns))
        share = (stamp_ns - int(stamps[i - 1])) / (int(stamps[i]) - int(stamps[i - 1]))
        at = kept.at(stamp_ns)
        for found, rows in ((at.position, positions), (at.velocity, velocities)):
            assert np.array_equal(found, rows[i - 1] + share * (rows[i] - rows[i - 1]))


def given_now(join):
    return [(item, None if p is None else p.stamp_ns // MS) for item, p in join.pop_ready()]


def test_image_waits_for_the_joint_states_of_its_time():
    kept = history((100, 0.0))
    join = PostureJoin(kept)
    join.queue_item(110 * MS, 'a')
    join.queue_item(130 * MS, 'b')
    assert given_now(join) == []
    kept.record_posture(120 * MS, (0.2, 0.0))
    assert given_now(join) == [('a', 110)]
    kept.record_posture(130 * MS, (0.3, 0.0))
    assert given_now(join) == [('b', 130)]
    assert len(join) == 0


def test_image_older_than_the_history_is_given_without_posture():
    join = PostureJoin(history((100, 0.0), (120, 0.1)))
    join.queue_item(50 * MS, 'old')
    join.queue_item(110 * MS, 'good')
    assert given_now(join) == [('old', None), ('good', 110)]


def test_waiting_is_bounded():
    join = PostureJoin(PostureHistory(), depth=3)
    for i in range(5):
        join.queue_item(i * MS, i)
    assert given_now(join) == [(0, None), (1, None)]
    assert len(join) == 3


def test_image_from_the_future_does_not_hold_up_the_others():
    """A clock set back leaves an item that waits for a time long gone."""
    kept = history((90_000, 0.0))
    join = PostureJoin(kept)
    join.queue_item(90 * NS_PER_S + 10 * MS, 'before the jump')
    kept.record_posture(100 * MS, (0.0, 0.0))
    kept.record_posture(120 * MS, (0.0, 0.0))
    join.queue_item(110 * MS, 'after it')
    assert given_now(join) == [('after it', 110)]


def test_items_behind_one_whose_handling_fails_still_wait():
    kept = history((100, 0.0), (120, 0.1))
    join = PostureJoin(kept)
    join.queue_item(105 * MS, 'breaks')
    join.queue_item(110 * MS, 'next')
    next(iter(join.pop_ready()))  # its handler raised: this iterator is not asked again
    assert given_now(join) == [('next', 110)]


def test_gap_of_more_than_half_a_second_is_not_bridged():
    kept = history((100, 0.0), (700, 0.6))
    assert kept.at(400 * MS) is None
    assert kept.at(700 * MS).position[0] == pytest.approx(0.6)


def test_clock_set_back_by_less_than_the_horizon_leaves_no_sample_of_the_old_time():
    kept = history((10_000, 0.5), (11_000, 0.6), (10_500, 0.1), (10_600, 0.2))
    assert kept.newest.stamp_ns == 10_600 * MS
    assert kept.at(10_550 * MS).position[0] == pytest.approx(0.15)
