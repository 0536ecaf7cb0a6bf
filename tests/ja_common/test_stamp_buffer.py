"""Which message belongs to a stamp, and how long one is waited for."""

from ja_common.core.stamp_buffer import StampBuffer

MS = 1_000_000


def buffer(within_s=0.02, patience_s=0.2):
    return StampBuffer(within_s, patience_s, depth=4)


def test_the_nearest_within_the_tolerance_is_found():
    kept = buffer()
    assert kept.nearest(100 * MS) is None
    assert kept.seconds_off(100 * MS) is None
    for stamp in (60, 90, 125):
        kept.record_item(stamp * MS, stamp)
    assert kept.nearest(100 * MS) == 90
    assert kept.nearest(120 * MS) == 125
    assert kept.nearest(150 * MS) is None
    assert kept.seconds_off(150 * MS) == 0.025


def test_what_was_sent_again_counts():
    kept = buffer()
    kept.record_item(100 * MS, 'first')
    kept.record_item(100 * MS, 'again')
    assert kept.nearest(100 * MS) == 'again'


def test_the_one_of_the_stamp_is_waited_for_although_another_is_near_enough():
    kept = buffer()
    kept.record_item(90 * MS, 'before')
    assert kept.must_wait(100 * MS, 0.0)
    kept.record_item(100 * MS, 'same')
    assert not kept.must_wait(100 * MS, 0.0)
    assert kept.nearest(100 * MS) == 'same'


def test_after_a_later_one_nothing_is_waited_for():
    kept = buffer()
    kept.record_item(110 * MS, 'after')
    assert not kept.must_wait(100 * MS, 0.0)
    assert kept.must_wait(120 * MS, 0.0)


def test_patience_is_spent_once_and_again_after_the_next_message():
    kept = buffer()
    assert kept.must_wait(100 * MS, 0.1)
    assert not kept.must_wait(100 * MS, 0.3)
    assert not kept.must_wait(200 * MS, 0.0)
    kept.record_item(210 * MS, 'at last')
    assert kept.must_wait(300 * MS, 0.0)


def test_a_clock_that_is_set_back_does_not_block():
    kept = buffer()
    kept.record_item(900 * MS, 'old time')
    kept.record_item(10 * MS, 'new time')
    assert kept.must_wait(20 * MS, 0.0)
    kept.record_item(20 * MS, 'same')
    assert kept.nearest(20 * MS) == 'same'
    assert not kept.must_wait(20 * MS, 0.0)


def test_only_the_newest_are_kept():
    kept = buffer()
    for stamp in range(10):
        kept.record_item(100 * stamp * MS, stamp)
    assert kept.nearest(0) is None
    assert kept.nearest(600 * MS) == 6
