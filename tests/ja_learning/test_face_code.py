"""Face codes: trained without labels, kept in files, and read by the first guess."""

import dataclasses

import numpy as np
import pytest
import torch

from drawn_faces import drawn_face
from ja_common.core.config import ConfigError
from ja_common.core.weight_files import note_weight_files
from ja_learning.core import others_face_code as others
from ja_learning.core import watched_face_code as watched
from ja_learning.core.checkpoint import load_checkpoint, save_checkpoint
from ja_learning.core.face_code import CodeOrigin, load_face_code, save_face_code
from ja_learning.core.gaze_line import GazeLineLearner
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.gaze_line_places import seen_places
from ja_learning.core.mean_face import contrasts, standardised
from ja_learning.core.trial import MeanFace, Trial

FIELD = np.array([0.6, 0.25])
LOOK = np.array([0.1, -0.05])


def made_trial(rng: np.random.Generator, objects: int = 4) -> tuple[Trial, int]:
    """Return a trial, and the index of the attended one of its candidates."""
    places = rng.uniform(-FIELD, FIELD, (objects, 2))
    attended = int(rng.integers(objects))
    face = drawn_face(places[attended])
    return Trial(face, LOOK, LOOK[None], LOOK + places[0], LOOK + places, objects), attended


@pytest.fixture(scope='module')
def pictures() -> tuple[np.ndarray, np.ndarray]:
    """Return gazes (n, 2) [rad] and pictures of a face that looks there."""
    gazes = np.random.default_rng(0).uniform(-FIELD / 2, FIELD / 2, (200, 2))
    return gazes, np.array([drawn_face(gaze) for gaze in gazes])


@pytest.fixture(scope='module')
def code(pictures):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(watched, '_STEPS', 200)
        return watched.watched_face_code(pictures[1], 20.0, seed=0)


@pytest.fixture
def file(code, tmp_path):
    path = tmp_path / 'code.npz'
    save_face_code(path, code)
    return path


def share_explained(numbers: np.ndarray, gazes: np.ndarray) -> np.ndarray:
    return np.array([np.corrcoef(numbers[:, i], gazes[:, i])[0, 1] ** 2 for i in range(2)])


def test_watching_finds_what_turns_without_any_label(code, pictures):
    gazes, faces = pictures
    numbers = code.numbers(contrasts(faces, code.mean_face))
    assert (share_explained(numbers, gazes) > 0.7).all()
    np.testing.assert_allclose(np.sqrt(np.square(numbers).mean(axis=0)), 1.0, atol=0.05)
    assert code.origin == CodeOrigin('watched', 20.0)


def test_features_are_odd_or_even_in_a_mirror(code, pictures):
    faces = contrasts(pictures[1][:20], code.mean_face)
    seen = code.features(faces)
    mirrored = code.features(np.ascontiguousarray(faces[:, :, ::-1]))
    np.testing.assert_allclose(mirrored.pan, -seen.pan, atol=1e-4)
    np.testing.assert_allclose(mirrored.tilt, seen.tilt, atol=1e-4)
    assert seen.pan.shape == (20, 3)
    assert (seen.tilt[:, -1] == 1).all()


def test_candidate_sets_of_others_teach_which_way_a_face_is_turned(monkeypatch, pictures):
    monkeypatch.setattr(others, '_STEPS', 300)
    rng = np.random.default_rng(1)
    caregivers = []
    for person in ('anna', 'bilal', 'anna'):
        trials = [made_trial(rng)[0] for _ in range(80)]
        faces = np.array([trial.face for trial in trials])
        places = [seen_places(trial.look, trial.candidates) for trial in trials]
        mean_face = standardised(faces).mean(axis=0)
        caregivers.append(
            others.OtherCaregiver(person, faces, mean_face, np.array(places, np.float32))
        )
    found = others.others_face_code(caregivers, 100.0, seed=0)
    assert found.origin == CodeOrigin('others', 100.0, 3, ('anna', 'bilal'), 240)
    gazes, faces = pictures
    numbers = found.numbers(contrasts(faces, standardised(faces).mean(axis=0)))
    assert (share_explained(numbers, gazes) > 0.7).all()


def test_training_draws_from_no_generator_but_its_own(monkeypatch, pictures):
    monkeypatch.setattr(watched, '_STEPS', 3)
    torch.manual_seed(5)
    before = torch.random.get_rng_state()
    first = watched.watched_face_code(pictures[1], 20.0, seed=0).state()
    again = watched.watched_face_code(pictures[1], 20.0, seed=0).state()
    assert torch.equal(before, torch.random.get_rng_state())
    assert all(np.array_equal(first[name], again[name]) for name in first)


def test_a_file_gives_the_same_code_and_is_noted(code, file, pictures):
    with note_weight_files() as noted:
        again = load_face_code(file, 'watched')
    faces = contrasts(pictures[1], code.mean_face)
    np.testing.assert_array_equal(again.numbers(faces), code.numbers(faces))
    np.testing.assert_array_equal(again.mean_face, code.mean_face)
    assert again.origin == code.origin
    assert noted == {'code.npz': again.sha256}
    assert file.stat().st_size < 200_000


@pytest.mark.parametrize(
    ('arrays', 'description', 'sentence'),
    [
        ({'deviations': np.zeros(2)}, {}, 'deviations must hold'),
        ({'network.gaze_weights': np.zeros((1, 4, 2), np.float32)}, {}, 'gaze_weights must be'),
        ({'mean_face': np.full((30, 25), np.nan, np.float32)}, {}, 'mean_face must hold'),
        ({}, {'kind': 'gaze_line'}, "it is a 'gaze_line'"),
        ({}, {'trained_on': 'labels'}, 'trained_on must be'),
        ({}, {'people': 3}, 'people must be'),
        ({}, {'seconds': -1}, 'must be numbers from 0'),
        ({}, {'trials': 'many'}, 'must be numbers from 0'),
    ],
)
def test_a_spoilt_file_is_refused(file, arrays, description, sentence):
    found, described = load_checkpoint(file)
    save_checkpoint(file, found | arrays, described | description)
    with pytest.raises(ConfigError, match=sentence):
        load_face_code(file)


def test_a_file_that_is_none_or_too_large_is_refused(tmp_path):
    path = tmp_path / 'code.npz'
    with pytest.raises(ConfigError, match='no such file'):
        load_face_code(path)
    path.write_bytes(b'no archive')
    with pytest.raises(ConfigError, match='no face code'):
        load_face_code(path)
    path.write_bytes(bytes(2**20 + 1))
    with pytest.raises(ConfigError, match='larger than'):
        load_face_code(path)


def test_a_code_of_another_track_is_refused(file):
    with pytest.raises(ConfigError, match='another track'):
        GazeLineLearner(GazeLineConfig(first_guess='others', face_code=str(file)), 0)


def learner_with(file, seed: int = 3) -> GazeLineLearner:
    config = GazeLineConfig(members=2, channels=4, first_guess='watched', face_code=str(file))
    return GazeLineLearner(config, seed)


def test_the_learner_knows_her_mean_face_from_watching(code, file):
    learner = learner_with(file)
    assert isinstance(learner.mean_face, MeanFace)
    np.testing.assert_array_equal(learner.mean_face.picture, code.mean_face)


def test_a_learner_with_a_code_needs_few_trials_and_resumes_bit_for_bit(file):
    learner, rng = learner_with(file), np.random.default_rng(2)
    known = learner.mean_face

    def next_trial():
        trial, attended = made_trial(rng)
        return dataclasses.replace(trial, mean_face=known), attended

    for _ in range(13):
        learner.update(next_trial()[0])
    again = learner_with(file, seed=99)
    again.restore(learner.state())
    right = 0
    for _ in range(60):
        trial, attended = next_trial()
        delta = learner.propose(trial.look, trial.face_at, trial.candidates)
        off = trial.candidates - trial.face_at - delta
        right += int(np.argmin(np.linalg.norm(off, axis=1)) == attended)
    assert right > 45
    trial, _ = next_trial()
    learner.update(trial)
    again.update(trial)
    one, other = learner.state(), again.state()
    assert one.keys() == other.keys()
    for name in one:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


def test_a_checkpoint_with_another_code_is_refused(file):
    learner, rng = learner_with(file), np.random.default_rng(2)
    for _ in range(4):
        learner.update(made_trial(rng)[0])
    state = learner.state()
    arrays, description = load_checkpoint(file)
    save_checkpoint(file, arrays, description | {'seconds': 30.0})
    with pytest.raises(ValueError, match='it learned with the face code'):
        learner_with(file).restore(state)
