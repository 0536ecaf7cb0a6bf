"""How probable does each gaze make what was seen? A table over gazes, one for each trial.

A trial enters the likelihood of a map from faces to gazes only through the gaze u that the map
gives for its face. So each trial is one picture over u, made once:

    S(u) = sum over its candidates c of p(c | u)

with p as in `gaze_line_mixture`: along the line of gaze where the distance of a candidate is
unknown, a direction from her eyes where it is known. The likelihood of any map is then a look-up
a trial, however many maps are compared.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ja_learning.core.compiled import compiled
from ja_learning.core.gaze_line_mixture import (
    FIRST_STRETCH,
    LAST_STRETCH,
    STRETCH_COUNT,
    LineMixture,
)

PAN_MOST, TILT_MOST, STEP = 2.4, 1.2, 0.06
"""The table reaches from minus to plus these gazes, in units of `ANGLE_SCALE_RAD`."""

_STRETCHES = np.exp(np.linspace(math.log(FIRST_STRETCH), math.log(LAST_STRETCH), STRETCH_COUNT))
_OF_STRETCH = 0.12
_UNIT = 2.0**-20


class GazeLevel(NamedTuple):
    """How well a gaze is known: deviations s_u and s_c, and how widely log r_k is spread."""

    deviation: float
    place_deviation: float
    stretch_spread: float


# A wide spread first: as long as little is known, any scale of the gaze goes with it. Once the
# scale is found, the stretches are as narrow as the depths of the things are alike.
LEVELS = (
    GazeLevel(0.1, 0.05, 9.0),
    GazeLevel(0.05, 0.05, 9.0),
    GazeLevel(0.07, 0.03, 0.25),
    GazeLevel(0.045, 0.015, 0.25),
    GazeLevel(0.03, 0.01, 0.2),
)
_COMMON_STRETCH = 0.9

_PANS = np.arange(-PAN_MOST, PAN_MOST + STEP / 2, STEP)
_TILTS = np.arange(-TILT_MOST, TILT_MOST + STEP / 2, STEP)
SHAPE = (len(LEVELS), len(_PANS), len(_TILTS))
"""The shape of a table: levels, pans, tilts."""


def _shares(level: GazeLevel) -> NDArray[np.float64]:
    off = np.log(_STRETCHES / _COMMON_STRETCH) / level.stretch_spread
    shares = np.exp(-0.5 * off**2)
    return np.asarray(shares / shares.sum())


_SHARES = np.array([_shares(level) for level in LEVELS])
_OF_PLACE = np.array([level.place_deviation**2 for level in LEVELS])
_DEVIATIONS = np.array([level.deviation for level in LEVELS])
# As a likelihood of u, places with and without a known distance have the same integral.
_FACTORS = np.array([np.sum(shares / _STRETCHES**2) for shares in _SHARES])


def level_mixture(levels: NDArray[np.int64]) -> LineMixture[NDArray[np.float64]]:
    """Return the belief's mixture of members that know the gaze as well as these levels."""

    def of_members(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return values[levels].reshape(len(levels), 1, -1)

    return LineMixture(
        stretches=_STRETCHES,
        log_shares=np.log(np.maximum(of_members(_SHARES), 1e-12)),
        origin_tilt=np.zeros((1, 1, 1)),
        of_stretch=np.full((1, 1, 1), _OF_STRETCH**2),
        of_gaze=of_members(_DEVIATIONS**2),
        of_place=of_members(_OF_PLACE),
    )


def gaze_table(places: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return S(u), of `SHAPE`, of places (m, 8) as in `gaze_line_places`."""
    return np.asarray(_table(np.ascontiguousarray(places, np.float64)), np.float32)


@compiled
def _table(places):  # type: ignore[no-untyped-def]
    found = np.zeros((len(_DEVIATIONS), len(_PANS), len(_TILTS)))
    for level in range(len(_DEVIATIONS)):
        for i in range(len(_PANS)):
            for j in range(len(_TILTS)):
                for m in range(len(places)):
                    found[level, i, j] += _of_place(places[m], level, i, j)
                found[level, i, j] = _rounded(found[level, i, j])
    return found


@njit(nogil=True)
def _rounded(value):  # type: ignore[no-untyped-def]
    """Return a multiple of a power of two: sums of tables are exact, in any order."""
    return np.float32(np.rint(value / _UNIT) * _UNIT)


@njit(nogil=True)
def _of_place(row, level, i, j):  # type: ignore[no-untyped-def]
    """Return p(c | u) of a place (8,) at one node of the table."""
    of_gaze, of_place = _DEVIATIONS[level] ** 2, _OF_PLACE[level]
    if np.isnan(row[4]):
        return _on_line(row, _PANS[i], _TILTS[j], of_gaze, of_place, _SHARES[level])
    return _FACTORS[level] * _from_eyes(row, _PANS[i], _TILTS[j], of_gaze, of_place)


@njit(nogil=True)
def _on_line(row, pan, tilt, of_gaze, of_place, shares):  # type: ignore[no-untyped-def]
    total = 0.0
    length = pan * pan + tilt * tilt
    for k in range(len(_STRETCHES)):
        stretch = _STRETCHES[k]
        squared = stretch * stretch
        across = squared * of_gaze + of_place
        further = squared * _OF_STRETCH**2
        along = across + further * length
        off_pan, off_tilt = row[0] - stretch * pan, row[1] - stretch * tilt
        on = off_pan * pan + off_tilt * tilt
        squares = (off_pan**2 + off_tilt**2 - further / along * on * on) / across
        if squares < 60.0:
            total += shares[k] * math.exp(-0.5 * squares) / math.sqrt(across * along)
    return total / (2 * math.pi)


@njit(nogil=True)
def _from_eyes(row, pan, tilt, of_gaze, of_place):  # type: ignore[no-untyped-def]
    spread = of_gaze + of_place * row[4] ** 2
    var_pan, both, var_tilt = row[5] + spread, row[6], row[7] + spread
    off_pan, off_tilt = row[2] - pan, row[3] - tilt
    determinant = var_pan * var_tilt - both * both
    squares = var_tilt * off_pan**2 - 2 * both * off_pan * off_tilt + var_pan * off_tilt**2
    return math.exp(-0.5 * squares / determinant) / (2 * math.pi * math.sqrt(determinant))


@njit(nogil=True)
def look_up(table, level, pan, tilt):  # type: ignore[no-untyped-def]
    """Return one value of a table, between its nodes; beyond its edges that of the edge."""
    i, j, x, y = _cell(pan, tilt)
    near = table[level]
    return (1 - x) * ((1 - y) * near[i, j] + y * near[i, j + 1]) + x * (
        (1 - y) * near[i + 1, j] + y * near[i + 1, j + 1]
    )


@njit(nogil=True)
def look_up_place(place, level, pan, tilt):  # type: ignore[no-untyped-def]
    """Return what `look_up` finds in the table of a single place (8,), without making the table.

    A cloud of maps asks a few hundred gazes; a table has thousands of nodes.
    """
    i, j, x, y = _cell(pan, tilt)
    near, nearer = (
        _rounded(_of_place(place, level, i, j)),
        _rounded(_of_place(place, level, i, j + 1)),
    )
    far, farther = (
        _rounded(_of_place(place, level, i + 1, j)),
        _rounded(_of_place(place, level, i + 1, j + 1)),
    )
    return (1 - x) * ((1 - y) * near + y * nearer) + x * ((1 - y) * far + y * farther)


@njit(nogil=True)
def _cell(pan, tilt):  # type: ignore[no-untyped-def]
    """Return the node below a gaze, and how far the gaze is beyond it, in steps."""
    x = min(max((pan + PAN_MOST) / STEP, 0.0), len(_PANS) - 1.001)
    y = min(max((tilt + TILT_MOST) / STEP, 0.0), len(_TILTS) - 1.001)
    return int(x), int(y), x - int(x), y - int(y)
