"""The first guess from eigenfaces, alone and in the fast learner."""

import dataclasses

import numpy as np
import pytest

from drawn_faces import drawn_face
from ja_learning.core.contrast_memory import ContrastMemory
from ja_learning.core.eigenface_posterior import EigenfacePosterior
from ja_learning.core.eigenfaces import COMPONENTS, Eigenfaces
from ja_learning.core.gaze_line import GazeLineLearner
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.gaze_line_places import ANGLE_SCALE_RAD, seen_places
from ja_learning.core.mean_face import contrast, standardised
from ja_learning.core.trial import Look, Trial

LOOK = np.array([0.1, -0.05])
CONFIG = GazeLineConfig(members=2, channels=4, first_guess='eigenfaces')


def made_trial(rng: np.random.Generator, objects: int = 4) -> tuple[Trial, int]:
    places = rng.uniform([-0.6, -0.25], [0.6, 0.25], (objects, 2))
    attended = int(rng.integers(objects))
    face = drawn_face(places[attended])
    trial = Trial(face, LOOK, LOOK[None], LOOK + places[0], LOOK + places, objects)
    return trial, attended


def test_components_are_odd_or_even_in_a_mirror_and_of_the_same_size():
    rng = np.random.default_rng(0)
    faces = np.array([contrast(made_trial(rng)[0].look) for _ in range(40)])
    found = Eigenfaces(faces)
    seen = found.features(faces)
    mirrored = found.features(np.ascontiguousarray(faces[:, :, ::-1]))
    np.testing.assert_allclose(mirrored.pan[:, :-1], -seen.pan[:, :-1], atol=1e-9)
    np.testing.assert_allclose(mirrored.tilt, seen.tilt, atol=1e-9)
    assert seen.pan.shape == seen.tilt.shape == (40, COMPONENTS + 1)
    assert (seen.pan[:, -1] == 1).all()
    assert (seen.tilt[:, -1] == 1).all()
    assert np.sqrt((seen.pan[:, 0] ** 2).mean()) == pytest.approx(1.0)


@pytest.mark.parametrize('faces', [1, 2, 3])
def test_few_faces_have_few_components(faces: int):
    rng = np.random.default_rng(0)
    pictures = np.array([contrast(made_trial(rng)[0].look) for _ in range(faces)])
    features = Eigenfaces(pictures).features(pictures)
    assert np.isfinite(features.pan).all()
    assert np.isfinite(features.tilt).all()


def test_faces_without_any_contrast_are_no_error():
    flat = standardised(np.full((4, 30, 25), 9, np.uint8))
    assert not Eigenfaces(flat).features(flat).pan[:, :-1].any()


def test_the_posterior_knows_the_attended_object_after_a_few_trials():
    rng, memory = np.random.default_rng(3), ContrastMemory(100)
    guess = EigenfacePosterior(memory, 0, 0)
    assert not guess.is_known
    for _ in range(20):
        trial, _ = made_trial(rng)
        memory.remember(trial, seen_places(trial.look, trial.candidates))
        guess.add_newest()
    right = 0
    for _ in range(60):
        trial, attended = made_trial(rng)
        places = seen_places(trial.look, trial.candidates)
        face = contrast(trial.look)
        ratios = guess.log_ratios_of_places(face, places)
        # Without making tables, the same.
        assert list(ratios) == [guess.log_ratios(face[None], each[None])[0] for each in places]
        right += int(np.argmax(ratios)) == attended
    assert right > 45


def share_right(learner: GazeLineLearner, rng: np.random.Generator, trials: int = 80) -> float:
    right = 0
    for _ in range(trials):
        trial, attended = made_trial(rng)
        delta = learner.propose(trial.look, LOOK, trial.candidates)
        nearest = np.argmin(np.linalg.norm(trial.candidates - LOOK - delta, axis=1))
        right += nearest == attended
    return right / trials


def test_with_a_first_guess_the_fast_learner_needs_a_dozen_trials():
    def trained(first_guess: str) -> float:
        config = GazeLineConfig(members=3, channels=4, first_guess=first_guess)
        learner, rng = GazeLineLearner(config, 3), np.random.default_rng(1)
        for _ in range(8):
            learner.update(made_trial(rng)[0])
        return share_right(learner, np.random.default_rng(9))

    with_guess = trained('eigenfaces')
    assert with_guess > trained('none') + 0.1
    assert with_guess > 0.7


def test_its_belief_joins_the_networks_and_the_maps():
    learner, rng = GazeLineLearner(CONFIG, 3), np.random.default_rng(1)
    for _ in range(10):
        learner.update(made_trial(rng)[0])
    look = Look(drawn_face(np.array([0.3, 0.1])), LOOK)
    density = learner.snapshot().log_density(contrast(look)[None], LOOK, (LOOK + 0.1)[None])
    assert np.isfinite(density).all()
    grid = np.linspace(-4, 4, 101) * ANGLE_SCALE_RAD
    places = np.stack(np.meshgrid(grid, grid, indexing='ij'), -1).reshape(-1, 2)
    total = np.exp(learner.snapshot().log_density(contrast(look)[None], LOOK, LOOK + places)).sum()
    assert total * (0.08 * ANGLE_SCALE_RAD) ** 2 == pytest.approx(1.0, abs=0.03)
    assert learner.belief(look, rng, 50).shape == (50, 2)


def test_a_restored_learner_goes_on_bit_for_bit():
    learner, rng = GazeLineLearner(CONFIG, 3), np.random.default_rng(2)
    for _ in range(20):
        learner.update(made_trial(rng)[0])
    again = GazeLineLearner(CONFIG, seed=99)
    again.restore(learner.state())
    for _ in range(5):  # the components are found again at the 24th
        trial, _ = made_trial(rng)
        learner.update(trial)
        again.update(trial)
    one, other = learner.state(), again.state()
    assert one.keys() == other.keys()
    for name in one:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


@pytest.mark.parametrize(
    ('name', 'spoilt'),
    [
        ('eigenfaces.odd', np.zeros((2, 750))),
        ('candidate_shares', np.zeros(3, np.float32)),
        ('maps.levels', np.full(400, 9)),
        ('eigenfaces.trials', np.array(-1)),
    ],
)
def test_another_state_is_refused_and_changes_nothing(name: str, spoilt: np.ndarray):
    learner, rng = GazeLineLearner(CONFIG, 3), np.random.default_rng(2)
    for _ in range(4):
        learner.update(made_trial(rng)[0])
    before = learner.state()
    with pytest.raises(ValueError, match=name.partition('.')[0]):
        learner.restore(before | {name: spoilt})
    after = learner.state()
    assert all(np.array_equal(before[each], after[each]) for each in before)


def test_when_the_world_is_mirrored_the_first_guess_starts_anew():
    learner, rng = GazeLineLearner(CONFIG, 3), np.random.default_rng(8)
    for trial in range(100):
        made, _ = made_trial(rng)
        face = made.face if trial < 50 else np.ascontiguousarray(made.face[:, ::-1])
        learner.update(dataclasses.replace(made, face=face))
    state = learner.state()
    assert state['eigenfaces.trials'] < 70, 'the trials before the change are forgotten'
    assert len(state['candidate_shares']) == 4 * len(state['faces'])
