"""Stamps stay unchanged, to the last nanosecond."""

import pytest

from ja_common.time_codec import to_ns, to_time


@pytest.mark.parametrize('stamp_ns', [0, 1, 999_999_999, 1_000_000_000, 1_764_000_000_123_456_789])
def test_there_and_back(stamp_ns):
    assert to_ns(to_time(stamp_ns)) == stamp_ns


def test_parts():
    time = to_time(3_000_000_005)
    assert (time.sec, time.nanosec) == (3, 5)
