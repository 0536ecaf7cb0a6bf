"""A learner trained on a recording: the same updates as live, the same weights every time."""

import csv

import numpy as np
import pytest

from ja_common.core.config import ConfigError
from ja_common.topics import FIXATION
from ja_learning.core.checkpoint import load_checkpoint
from ja_learning.core.checkpoint_folder import LAST
from ja_learning.core.network import ThreeLayerNetwork
from ja_learning.core.network_config import NetworkConfig
from ja_learning.core.trial import Trial
from ja_recording.core.reader import Recording
from ja_recording.learner_score import score_learner, success_rate, write_csv
from recorded_days import LOOK, TRIALS, day, messages_of, recorded
from recordings import write_recording


def train(recording: Recording, folder, seed: int = 0, **parameters):
    """Return the scored trials, and the weights in the end."""
    every = {'checkpoint_folder': folder, 'seed': seed, **parameters}
    arguments = [part for name, value in every.items() for part in ('-p', f'{name}:={value}')]
    return score_learner(recording, arguments), load_checkpoint(folder / LAST)[0]


def same(a, b) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


@pytest.mark.parametrize('learner', ['paper', 'gaze_line'])
def test_the_same_recording_and_seed_give_the_same_weights(learner, tmp_path):
    recording = recorded(tmp_path / 'r')
    first = train(recording, tmp_path / 'a', learner=learner)
    assert len(first[0]) == TRIALS
    again = train(recording, tmp_path / 'b', learner=learner)
    assert first[0] == again[0]
    assert same(first[1], again[1])


def test_another_seed_gives_other_weights(tmp_path):
    recording = recorded(tmp_path / 'r')
    _, weights = train(recording, tmp_path / 'a', seed=0)
    _, others = train(recording, tmp_path / 'b', seed=1)
    assert not same(weights, others)


def test_the_node_learns_what_the_network_learns_from_the_same_trials(tmp_path):
    _, weights = train(recorded(tmp_path / 'r'), tmp_path / 'a', seed=3)
    network = ThreeLayerNetwork(NetworkConfig(), 3)
    for face, attended, _ in day():
        network.update(Trial(face, LOOK, LOOK[np.newaxis], attended))
    for name in ('hidden_weights', 'hidden_biases', 'output_weights', 'output_biases'):
        array = network.state()[name]
        np.testing.assert_allclose(weights[name], array, atol=1e-6)


def test_the_curve_rises_and_knows_the_truth(tmp_path):
    recording = recorded(tmp_path / 'r', count=3 * TRIALS)
    trials, _ = train(recording, tmp_path / 'a', learning_rate=0.03)
    offs = [trial.off_rad for trial in trials]
    assert np.mean(offs[-10:]) < 0.6 * np.mean(offs[:10])
    assert success_rate(trials, 'recorded').rate == 1.0
    assert success_rate(trials[-10:]).rate > success_rate(trials[:10]).rate


def test_without_truth_there_is_an_angle_but_no_success(tmp_path):
    trials, _ = train(recorded(tmp_path / 'r', with_truth=False), tmp_path / 'a')
    assert len(trials) == TRIALS
    assert {trial.success for trial in trials} == {None}
    assert success_rate(trials).trials == 0
    write_csv(trials, tmp_path / 'a.csv')
    rows = list(csv.DictReader((tmp_path / 'a.csv').open()))
    assert [float(row['off_rad']) for row in rows] == [trial.off_rad for trial in trials]
    assert rows[0]['success'] == ''
    assert {row['track'] for row in rows} == {'strict'}


def test_a_recording_without_what_a_learner_needs_is_refused(tmp_path):
    messages = [each for each in messages_of(day()) if each[1] is not FIXATION]
    recording = Recording(write_recording(tmp_path / 'r', messages))
    with pytest.raises(ConfigError, match='lacks fixation'):
        score_learner(recording)
