"""The learner from landmarks: what it learns without labels, with and without depth."""

import dataclasses

import numpy as np
import pytest

from ja_common.core.face_gaze import FaceGaze
from ja_common.core.geometry import directions_of_vectors
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.landmark_features import landmark_features, read_landmarks
from ja_learning.core.landmark_learner import LandmarkLearner
from ja_learning.core.learner_registry import make_learner
from ja_learning.core.trial import Look, Trial

FACE = np.array([1.2, 0.0, 0.0])
BLANK = np.zeros((30, 25), np.uint8)
CONFIG = GazeLineConfig(face_reader='landmarks')
HERE = np.zeros(2)


def reading(towards: np.ndarray, rng: np.random.Generator, mirrored: bool = False) -> FaceGaze:
    """Make a reading of a person who looks at a point [m]: head 0.75, eyes the rest."""
    aside, towards_robot, up = towards[1], FACE[0] - towards[0], towards[2]
    gaze = np.array(
        [np.arctan2(aside, towards_robot), -np.arctan2(up, np.hypot(aside, towards_robot))]
    )
    if mirrored:
        gaze[0] *= -1
    head = 0.75 * gaze + np.radians(1.0) * rng.normal(size=2)
    eyes = gaze - head + np.radians(1.5) * rng.normal(size=2)
    return FaceGaze(np.array([*head, 0.0]), 0.03, np.tile(eyes, (2, 1)), 0.03)


def made_trial(
    rng: np.random.Generator, objects: int = 5, depth: bool = False, mirrored: bool = False
) -> tuple[Trial, int]:
    """Make a trial, and return which of its candidates is attended."""
    points = rng.uniform([0.4, -0.5, -0.15], [0.8, 0.5, 0.15], (objects, 3))
    attended = int(rng.integers(objects))
    distances = np.linalg.norm(points, axis=1)
    trial = Trial(
        BLANK,
        HERE,
        HERE[None],
        None,
        directions_of_vectors(points),
        objects,
        np.stack([distances, 0.02 * distances], axis=1) if depth else None,
        np.array([1.2, 0.02]) if depth else np.full(2, np.nan),
        reading(points[attended], rng, mirrored),
    )
    return trial, attended


def share_right(
    learner: LandmarkLearner, rng: np.random.Generator, trials: int = 100, **made: bool
) -> float:
    right = 0
    for _ in range(trials):
        trial, attended = made_trial(rng, **made)
        delta = learner.propose(trial.look, HERE, trial.candidates, trial.ranges)
        right += np.argmin(np.linalg.norm(trial.candidates - delta, axis=1)) == attended
    return right / trials


def trained(trials: int, seed: int = 0, **made: bool) -> LandmarkLearner:
    learner, rng = LandmarkLearner(CONFIG, seed), np.random.default_rng([seed, 1])
    for _ in range(trials):
        learner.update(made_trial(rng, **made)[0])
    return learner


def test_it_is_the_fast_learner_that_reads_landmarks():
    assert isinstance(make_learner('gaze_line', 0, CONFIG), LandmarkLearner)
    assert not isinstance(make_learner('gaze_line', 0), LandmarkLearner)


def test_twenty_trials_without_labels_are_enough():
    untrained = LandmarkLearner(CONFIG, 3)
    assert share_right(untrained, np.random.default_rng(7)) < 0.5
    assert (
        np.mean([share_right(trained(20, seed), np.random.default_rng(7)) for seed in range(3)])
        > 0.75
    )


def test_depth_helps():
    without, with_depth = (
        np.mean(
            [
                share_right(trained(40, seed, **made), np.random.default_rng(7), **made)
                for seed in range(2)
            ]
        )
        for made in ({}, {'depth': True})
    )
    assert with_depth > without


def test_what_was_learned_with_depth_holds_where_she_sits_nearer():
    learner, rng = trained(60, depth=True), np.random.default_rng(5)
    right = 0
    for _ in range(60):
        trial, attended = made_trial(rng, depth=True)
        # All of it 0.3 m nearer to the robot: directions change, her head's angles do not.
        points = trial.ranges[:, :1] * _vectors(trial.candidates) - [0.3, 0.0, 0.0]
        distances = np.linalg.norm(points, axis=1)
        ranges = np.stack([distances, 0.02 * distances], axis=1)
        look = dataclasses.replace(trial.look, face_range=np.array([0.9, 0.02]))
        directions = directions_of_vectors(points)
        delta = learner.propose(look, HERE, directions, ranges)
        right += np.argmin(np.linalg.norm(directions - delta, axis=1)) == attended
    assert right / 60 > 0.8


def _vectors(directions: np.ndarray) -> np.ndarray:
    pan, tilt = directions.T
    return np.stack(
        [np.cos(tilt) * np.cos(pan), np.cos(tilt) * np.sin(pan), -np.sin(tilt)], axis=1
    )


def test_a_look_without_a_reading_gives_no_proposal_and_changes_nothing_but_the_count():
    learner = trained(5)
    before = learner.state()
    trial, _ = made_trial(np.random.default_rng(0))
    blinking = dataclasses.replace(trial, gaze=None)
    assert learner.propose(blinking.look, HERE, blinking.candidates) is None
    assert learner.belief(blinking.look, np.random.default_rng(0), 10).shape == (0, 2)
    learner.update(blinking)
    after = learner.state()
    assert learner.trials == 6
    assert all(np.array_equal(before[name], after[name]) for name in before if name != 'trials')


def test_a_hidden_eye_is_left_out():
    gaze = FaceGaze(np.zeros(3), 0.03, np.array([[0.2, 0.1], [np.nan, np.nan]]), 0.03)
    found = read_landmarks(Look(BLANK, HERE, gaze=gaze))
    np.testing.assert_allclose(found * np.radians(40), [0, 0, 0, 0.2, 0.1, np.radians(20)])
    blind = gaze._replace(eyes=np.full((2, 2), np.nan))
    np.testing.assert_allclose(read_landmarks(Look(BLANK, HERE, gaze=blind)), np.zeros(6))


def test_features_are_odd_or_even_in_a_mirror():
    gaze = FaceGaze(np.array([0.4, -0.1, 0.05]), 0.03, np.array([[0.1, 0.02], [0.2, 0.04]]), 0.03)
    here, there = (
        read_landmarks(Look(BLANK, HERE, gaze=each))[None] for each in (gaze, gaze.mirrored())
    )
    seen, mirrored = landmark_features(here), landmark_features(there)
    np.testing.assert_allclose(mirrored.pan, -seen.pan, atol=1e-7)
    np.testing.assert_allclose(mirrored.tilt, seen.tilt, atol=1e-7)
    assert np.abs(seen.pan[:, [0, 1, 2, 4, 5]]).min() > 0


def test_readings_that_have_nothing_to_do_with_what_was_seen_give_no_evidence():
    learner, rng, highest = LandmarkLearner(CONFIG, 1), np.random.default_rng(6), 0.0
    for _ in range(70):
        trial, other = made_trial(rng)[0], made_trial(rng)[0]
        learner.update(dataclasses.replace(trial, gaze=other.gaze))
        highest = max(highest, learner.log_evidence)
    assert highest < np.log(20)


def test_when_the_world_is_mirrored_it_learns_again():
    learner, rng = trained(60), np.random.default_rng(8)
    assert learner.log_evidence > 20
    for _ in range(60):
        learner.update(made_trial(rng, mirrored=True)[0])
    assert share_right(learner, np.random.default_rng(9), mirrored=True) > 0.7
    assert len(learner.state()['faces']) < 90, 'the trials before the change are forgotten'


def test_a_restored_learner_goes_on_bit_for_bit():
    learner, again = trained(25, depth=True), LandmarkLearner(CONFIG, seed=99)
    again.restore(learner.state())
    rng = np.random.default_rng(2)
    for _ in range(3):
        trial, _ = made_trial(rng, depth=True)
        learner.update(trial)
        again.update(trial)
    one, other = learner.state(), again.state()
    assert one.keys() == other.keys()
    for name in one:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)
    asked = made_trial(rng, depth=True)[0]
    for each in (learner, again):
        each.snapshot()
    np.testing.assert_array_equal(
        learner.propose(asked.look, HERE, asked.candidates, asked.ranges),
        again.propose(asked.look, HERE, asked.candidates, asked.ranges),
    )


@pytest.mark.parametrize(
    ('name', 'spoilt', 'why'),
    [
        ('maps.pan', np.zeros((3, 12)), 'of shape'),
        ('maps.levels', np.full(400, 77), 'below'),
        ('maps.none', np.full(400, 1.0), 'numbers from'),
        ('maps.log_weights', np.full(400, np.nan), 'numbers from'),
        ('faces', np.zeros((1, 30, 25), np.uint8), 'faces'),
        ('doubt', np.array(-1.0), 'numbers from'),
    ],
)
def test_another_state_is_refused_and_changes_nothing(name: str, spoilt: np.ndarray, why: str):
    learner = trained(3)
    before = learner.state()
    with pytest.raises(ValueError, match=why):
        learner.restore(before | {name: spoilt})
    after = learner.state()
    assert all(np.array_equal(before[each], after[each]) for each in before)
