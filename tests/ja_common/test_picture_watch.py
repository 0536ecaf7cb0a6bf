"""Warnings about pictures that decode well and show nothing."""

import numpy as np
import pytest

from ja_common.core.picture_watch import PictureWatch

RNG = np.random.default_rng(0)


def noise(low=60, high=200):
    return RNG.integers(low, high, (240, 320, 3), np.uint8)


def problems(pictures, frozen_after_s=10.0, period_s=0.5):
    watch = PictureWatch(frozen_after_s)
    return [watch.record_picture(p, i * period_s) for i, p in enumerate(pictures)]


@pytest.mark.parametrize(('low', 'high', 'word'), [(0, 12, 'black'), (252, 256, 'white')])
def test_black_and_white_pictures_are_reported_once_they_last(low, high, word):
    found = problems([noise(low, high) for _ in range(6)])
    assert found[:4] == [None] * 4
    assert f'nearly {word}' in found[4]


def test_a_short_darkness_and_a_dark_picture_with_a_lamp_are_no_problem():
    lamp = noise(0, 12)
    lamp[100:140, 100:140] = 220
    assert not any(problems([noise(0, 12), noise(0, 12), noise(), noise(0, 12)] + [lamp] * 6))


def test_pictures_that_never_change_are_reported_until_they_do():
    still = noise()
    found = problems([still] * 22 + [noise()])
    assert not any(found[:20])
    assert 'every image for 10 s is the same' in found[20]
    assert found[22] is None


def test_a_change_of_one_pixel_counts_wherever_it_is():
    still = noise()
    pictures = []
    for i in range(40):
        picture = still.copy()
        picture[1, 1, 0] = i
        pictures.append(picture)
    assert not any(problems(pictures))


def test_zero_ends_the_warning_about_still_pictures():
    assert not any(problems([noise()] * 40, frozen_after_s=0.0))
