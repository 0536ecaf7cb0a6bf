"""The learner's picture of the face."""

import numpy as np
import pytest

from ja_perception.core.box import Box
from ja_perception.core.face_crop import crop_face


def ramp():
    return np.tile(np.arange(0, 240, 2, dtype=np.uint8), (100, 1))


def test_size_and_orientation():
    crop = crop_face(ramp(), Box(60, 50, 50, 60))
    assert crop.shape == (30, 25)
    assert crop.dtype == np.uint8
    # Columns are 2 px wide; their centres start at 60 - 25 + 0.5 + 0.5.
    assert crop[10].astype(float) == pytest.approx(2 * (36 - 0.5 + 2 * np.arange(25)), abs=1)


def test_placed_to_a_fraction_of_a_pixel():
    rows, columns = np.indices((100, 120))
    blob = (250 * np.exp(-((columns - 60) ** 2 + (rows - 50) ** 2) / 150)).astype(np.uint8)

    def centre(shift):
        crop = crop_face(blob, Box(60 + shift, 50, 50, 60)).astype(float)
        return (crop * np.arange(25)).sum() / crop.sum()

    for shift in (0.25, 0.5, 0.75):
        assert centre(0) - centre(shift) == pytest.approx(shift / 2, abs=0.02)


def test_finer_detail_than_the_crop_is_averaged_not_aliased():
    stripes = np.tile(np.uint8([0, 255]), (200, 100))
    crop = crop_face(stripes, Box(99.5, 99.5, 150, 180))
    assert crop.astype(float) == pytest.approx(np.full((30, 25), 127.5), abs=45)


def test_beyond_the_image_its_border_repeats():
    crop = crop_face(ramp(), Box(0, 50, 50, 60))
    assert not crop[:, :12].any()
