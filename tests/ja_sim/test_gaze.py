"""Kinematics of the caregiver's gaze, in numbers worked out by hand."""

import numpy as np
import pytest

from ja_common.core.geometry import directions_of_vectors, head_rotation
from ja_sim.core.gaze import (
    EYE_RANGE_RAD,
    GazeShift,
    eye_angles,
    head_angles,
    minimum_jerk,
    missed_point,
)

EYES = np.array([[0.08, 0.03, 0.10], [0.08, -0.03, 0.10]])


def test_head_takes_its_share_of_the_angle():
    # 45 degrees to her left and level with her eyes.
    target = np.array([0.08 + 0.5, 0.5, 0.10])
    np.testing.assert_allclose(head_angles(target, EYES, 0.6), np.radians([27.0, 0.0]), atol=1e-12)


def test_left_is_positive_yaw_and_down_is_positive_pitch():
    yaw, pitch = head_angles(np.array([0.6, 0.3, -0.2]), EYES, 1.0)
    assert yaw > 0
    assert pitch > 0


def test_each_eye_points_exactly_at_the_target():
    target, head = np.array([0.5, 0.25, 0.0]), np.radians([18.0, 8.0])
    for eye, angles in zip(EYES, eye_angles(target, EYES, head), strict=True):
        rotation = head_rotation(head)
        gaze = rotation @ head_rotation(angles) @ [1.0, 0.0, 0.0]
        direction = target - rotation @ eye
        np.testing.assert_allclose(gaze, direction / np.linalg.norm(direction), atol=1e-9)


def test_a_missed_target_is_as_far_away_but_beside_it():
    target = np.array([0.58, 0.0, 0.10])  # half a metre straight ahead of her eyes
    point = missed_point(target, EYES, np.radians([1.0, -2.0]))
    centre = EYES.mean(axis=0)
    assert np.linalg.norm(point - centre) == pytest.approx(0.5)
    np.testing.assert_allclose(directions_of_vectors(point - centre), np.radians([1.0, -2.0]))
    np.testing.assert_allclose(missed_point(target, EYES, np.zeros(2)), target)


def test_eyes_converge_on_what_is_near():
    left, right = eye_angles(np.array([0.4, 0.0, 0.1]), EYES, np.zeros(2))
    assert left[0] < 0 < right[0]


def test_eyes_stop_at_their_range():
    angles = eye_angles(np.array([-0.5, 1.0, 0.1]), EYES, np.zeros(2))
    np.testing.assert_allclose(angles[:, 0], EYE_RANGE_RAD[0])


def test_minimum_jerk_goes_from_rest_to_rest():
    assert minimum_jerk(-1.0) == 0.0
    assert minimum_jerk(0.5) == pytest.approx(0.5)
    assert minimum_jerk(2.0) == 1.0
    assert minimum_jerk(0.01) < 2e-5


def test_a_shift_waits_for_the_reaction_then_turns_head_after_eyes():
    straight, left = np.array([1.0, 0.0, 0.1]), np.array([0.6, 0.5, 0.1])
    shift = GazeShift(EYES, straight)
    shift.start(1.0, 0.4, left, share=0.7, noise=np.zeros(2))
    before, early, after = shift.pose(0.99), shift.pose(1.05), shift.pose(1.4)
    np.testing.assert_allclose(before.head, [0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(after.head, head_angles(left, EYES, 0.7))
    # The eyes are already on the way when the head has hardly begun.
    assert early.eyes[0, 0] > 0.5
    assert early.head[0] < 0.1 * after.head[0]


def test_a_shift_begins_where_the_last_one_was_interrupted():
    shift = GazeShift(EYES, np.array([1.0, 0.0, 0.1]))
    shift.start(0.0, 1.0, np.array([0.6, 0.5, 0.1]), 1.0, np.zeros(2))
    interrupted = shift.pose(0.5).head
    shift.start(0.5, 1.0, np.array([0.6, -0.5, 0.1]), 1.0, np.zeros(2))
    np.testing.assert_allclose(shift.pose(0.5).head, interrupted)
