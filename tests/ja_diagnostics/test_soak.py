"""What grows is told from what has filled once."""

import numpy as np
import pytest

from ja_diagnostics.soak import COLUMNS, Series


def growth(values):
    times_s = list(10.0 * np.arange(len(values)))
    row = Series('memory', 'MB', times_s, list(values)).row()
    assert len(row) == len(COLUMNS)
    return float(row[3])


def test_what_grows_for_ever_grows():
    assert growth(100.0 + 0.1 * np.arange(90)) == pytest.approx(36.0)


def test_what_filled_at_the_beginning_does_not():
    assert growth(np.minimum(100.0 + 5.0 * np.arange(90), 200.0)) == 0.0


def test_noise_is_no_growth():
    assert abs(growth(100.0 + np.random.default_rng(0).normal(0.0, 0.1, 300))) < 0.2
