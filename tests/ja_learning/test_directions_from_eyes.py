"""Directions from her eyes: the geometry of depth."""

import numpy as np
import pytest

from ja_common.core.geometry import directions_of_vectors
from ja_learning.core.directions_from_eyes import MOST_UNCERTAIN, directions_from_eyes

FACE = np.array([1.2, 0.0, 0.0])
HERE = np.zeros(2)
NEAR = [1.2, 0.01]


def seen(*points: tuple[float, float, float], deviation: float = 0.01) -> tuple[np.ndarray, ...]:
    """Return directions and ranges of points [m] in the base frame."""
    vectors = np.array(points)
    distances = np.linalg.norm(vectors, axis=1)
    ranges = np.stack([distances, np.full(len(distances), deviation)], axis=1)
    return directions_of_vectors(vectors), ranges


def test_signs_and_angles_are_those_of_the_robots_head():
    # 0.3 m towards the robot, 0.3 m to the robot's left; the same to the right and below.
    directions, ranges = seen((0.9, 0.3, 0.0), (0.9, -0.3, 0.0), (0.9, 0.0, -0.3), (0.6, 0.0, 0.0))
    found = np.degrees(directions_from_eyes(directions, ranges, HERE, NEAR)[:, :2])
    np.testing.assert_allclose(found, [[45, 0], [-45, 0], [0, 45], [0, 0]], atol=1e-9)


def test_where_she_sits_does_not_matter():
    directions, ranges = seen((0.9, 0.3, -0.2))
    at_home = directions_from_eyes(directions, ranges, HERE, NEAR)
    turn = np.radians(35)
    rotation = np.array(
        [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    )
    moved, moved_ranges = seen(tuple(rotation @ [0.9, 0.3, -0.2]))
    elsewhere = directions_from_eyes(moved, moved_ranges, [turn, 0.0], NEAR)
    np.testing.assert_allclose(elsewhere, at_home, atol=1e-9)


def test_her_distance_is_in_distances_of_the_thing():
    directions, ranges = seen((0.9, 0.4, 0.0))
    assert directions_from_eyes(directions, ranges, HERE, NEAR)[0, 2] == pytest.approx(1.2 / 0.5)


def test_the_covariance_is_that_of_noisy_distances():
    directions, ranges = seen((0.8, 0.3, -0.15), deviation=0.02)
    stated = directions_from_eyes(directions, ranges, HERE, [1.2, 0.03])[0, 3:]
    rng = np.random.default_rng(0)
    drawn = np.array(
        [
            directions_from_eyes(
                directions,
                [[ranges[0, 0] + 0.02 * rng.normal(), 0.02]],
                HERE,
                [1.2 + 0.03 * rng.normal(), 0.03],
            )[0, :2]
            for _ in range(3000)
        ]
    )
    (pan, both), (_, tilt) = np.cov(drawn.T)
    np.testing.assert_allclose(stated, [pan, both, tilt], rtol=0.12)


@pytest.mark.parametrize(
    ('its_range', 'her_range'),
    [
        ([np.nan, np.nan], NEAR),
        ([0.9, np.nan], NEAR),
        ([0.9, 0.01], [np.nan, np.nan]),
        ([0.9, 1.01 * MOST_UNCERTAIN * 0.9], NEAR),
        ([1.2, 0.01], NEAR),  # at her eyes: in no direction from them
    ],
)
def test_an_unknown_distance_gives_nothing(its_range: list[float], her_range: list[float]):
    found = directions_from_eyes([HERE, [0.3, 0.1]], [its_range, [0.9, 0.02]], HERE, her_range)
    assert np.isnan(found[0]).all()
    assert np.isnan(found[1]).all() == np.isnan(her_range[0]), 'the other thing is not concerned'


def test_without_ranges_nothing_is_known():
    assert np.isnan(directions_from_eyes([[0.3, 0.1]], None, HERE, NEAR)).all()
