"""From a recording to a data set: it holds what the learner learned from."""

import numpy as np
import pytest
from typer.testing import CliRunner

from ja_bringup.cli import app
from ja_common.core.config import ConfigError
from ja_learning.core.checkpoint import load_checkpoint
from ja_learning.core.checkpoint_folder import LAST
from ja_learning.core.network import ThreeLayerNetwork
from ja_learning.core.network_config import NetworkConfig
from ja_recording.core.dataset import TrialSample, read_dataset
from ja_recording.learner_score import score_learner
from recorded_days import LOOK, TRIALS, day, messages_of, recorded
from recordings import write_recording


def exported(tmp_path, *paths) -> list[TrialSample]:
    """Return the data set that `./ja export` writes."""
    command = ['export', *map(str, paths), '--to', str(tmp_path / 'data')]
    done = CliRunner().invoke(app, command, obj=[], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return read_dataset(tmp_path / 'data')


def test_the_data_set_holds_what_was_seen_and_done(tmp_path):
    recorded(tmp_path / 'monday')
    samples = exported(tmp_path, tmp_path / 'monday')
    assert len(samples) == TRIALS
    for sample, (face, attended, other) in zip(samples, day(), strict=True):
        np.testing.assert_array_equal(sample.trial.face, face)
        np.testing.assert_array_equal(sample.trial.postures, [LOOK])
        # Detections travel as float32.
        np.testing.assert_allclose(sample.trial.candidates, [attended, other], atol=1e-6)
        np.testing.assert_array_equal(sample.trial.fixation, attended)
        np.testing.assert_allclose(sample.attended_direction, attended, atol=1e-6)
        assert sample.joint_attention
        assert sample.recording == 'monday'
        assert sample.fixation_ns - sample.look_ns == 100_000_000


def test_a_learner_of_the_data_set_becomes_the_learner_of_the_recording(tmp_path):
    recording = recorded(tmp_path / 'monday')
    arguments = ['-p', f'checkpoint_folder:={tmp_path / "trained"}', '-p', 'seed:=3']
    score_learner(recording, arguments)
    weights, _ = load_checkpoint(tmp_path / 'trained' / LAST)
    network = ThreeLayerNetwork(NetworkConfig(), 3)
    for sample in exported(tmp_path, tmp_path / 'monday'):
        network.update(sample.trial)
    for name, array in network.state().items():
        np.testing.assert_array_equal(weights[name], array, err_msg=name)


def test_several_recordings_make_one_data_set(tmp_path):
    recorded(tmp_path / 'monday', count=3)
    recorded(tmp_path / 'tuesday', count=2, with_truth=False)
    samples = exported(tmp_path, tmp_path / 'monday', tmp_path / 'tuesday')
    assert [sample.recording for sample in samples] == ['monday'] * 3 + ['tuesday'] * 2
    assert [sample.target[0] for sample in samples] == ['truth'] * 3 + ['fixation'] * 2
    card = (tmp_path / 'data' / 'README.md').read_text()
    assert '| `tuesday` | 2 |' in card
    assert '| fixation | 2 |' in card


def test_a_recording_without_trials_makes_no_data_set(tmp_path):
    looks_only = (each for each in messages_of(day(2)) if each[0] == 0)
    write_recording(tmp_path / 'sunday', looks_only)
    with pytest.raises(ConfigError, match='no trial ended in a fixation'):
        exported(tmp_path, tmp_path / 'sunday')
    assert not (tmp_path / 'data' / 'trials.parquet').exists()
