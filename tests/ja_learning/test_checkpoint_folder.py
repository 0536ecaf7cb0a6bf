"""What was learned outlives the process: the newest good checkpoint, older ones, one sentence."""

import json
import os
import re
from pathlib import Path

import numpy as np
import pytest

from ja_common.core.config import ConfigError
from ja_learning.core.checkpoint import load_checkpoint, save_checkpoint
from ja_learning.core.checkpoint_folder import LAST, CheckpointConfig, CheckpointFolder, Resumed
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.learner_registry import LEARNERS, make_learner
from ja_learning.core.network_config import NetworkConfig
from made_up_trials import trial

KINDS = tuple(LEARNERS)


def untrained(kind='paper', seed=0, **network):
    gaze_line = GazeLineConfig(replay_steps=1, replay_memory=20)
    return make_learner(kind, seed, NetworkConfig(**network) if kind == 'paper' else gaze_line)


def trained(trials=3, **choice):
    learner = untrained(**choice)
    for number in range(trials):
        learner.update(trial(number))
    return learner


def same(one, other):
    ours, tresumeds = one.state(), other.state()
    return ours.keys() == tresumeds.keys() and all(
        np.array_equal(ours[name], tresumeds[name]) for name in ours
    )


@pytest.fixture
def folder(tmp_path):
    opened = reopened(tmp_path / 'checkpoints')
    yield opened
    opened.close()


def reopened(path, **config):
    return CheckpointFolder(path, CheckpointConfig(checkpoints_kept=3, **config))


def names(folder):
    return sorted(path.name for path in folder.folder.glob('[!.]*'))


@pytest.mark.parametrize('kind', KINDS)
def test_another_process_continues_bit_for_bit(folder, kind):
    learner = trained(30, kind=kind)
    path = folder.save(learner)
    resumed = untrained(kind=kind, seed=9)
    assert folder.resume_into(resumed) == Resumed(path, [])
    assert same(resumed, learner)
    for number in range(30, 40):
        learner.update(trial(number))
        resumed.update(trial(number))
    assert same(resumed, learner)


def test_the_file_holds_the_whole_configuration(folder):
    learner = trained(face_scaling='standardised')
    _, description = load_checkpoint(folder.save(learner))
    assert description['learner'] == 'paper'
    assert description['trials'] == 3
    assert NetworkConfig(**description['configuration']) == learner.config


def test_an_empty_folder_is_no_error(folder):
    learner = untrained()
    assert folder.resume_into(learner) == Resumed(None, [])
    assert same(learner, untrained())


def test_older_ones_are_kept_and_numbers_rise_over_restarts(folder):
    for _ in range(5):
        folder.save(trained())
    assert names(folder) == [LAST, *(f'paper-00000{number}.npz' for number in (3, 4, 5))]
    assert os.readlink(folder.folder / LAST) == 'paper-000005.npz'
    folder.close()
    again = reopened(folder.folder)
    assert again.save(trained()).name == 'paper-000006.npz'
    again.close()


def test_one_learner_never_removes_checkpoints_of_another(folder):
    folder.save(trained(kind='gaze_line'))
    for _ in range(4):
        folder.save(trained(kind='paper'))
    assert 'gaze_line-000001.npz' in names(folder)


def test_a_learner_after_a_reset_is_newer_than_one_that_knew_more(folder):
    folder.save(trained(10))
    path = folder.save(untrained())
    resumed = trained(10)
    assert folder.resume_into(resumed).path == path
    assert resumed.trials == 0


def spoil_by_cutting(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def spoil_by_a_flipped_bit(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def spoil_description(path: Path, **changes) -> None:
    arrays, description = load_checkpoint(path)
    save_checkpoint(path, arrays, {**description, **changes})


def spoil_arrays(path: Path, **changes) -> None:
    arrays, description = load_checkpoint(path)
    save_checkpoint(path, {**arrays, **changes}, description)


CONFIGURATION = json.loads(json.dumps(vars(NetworkConfig())))
SPOILED = {
    'cut short': (spoil_by_cutting, 'was cut short'),
    'flipped bit': (spoil_by_a_flipped_bit, 'not a readable checkpoint'),
    'empty': (lambda path: path.write_bytes(b''), 'is not a checkpoint'),
    'text': (lambda path: path.write_text('weights'), 'is not a checkpoint'),
    'folder': (lambda path: (path.unlink(), path.mkdir()), 'is not a checkpoint'),
    'other npz': (lambda path: np.savez(path, a=np.zeros(3)), 'not a readable checkpoint'),
    'older format': (
        lambda path: spoil_description(path, format='joint-attention-checkpoint-1'),
        "has format 'joint-attention-checkpoint-1'",
    ),
    'other learner': (
        lambda path: spoil_description(path, learner='gaze_line'),
        "is of the learner 'gaze_line', not 'paper'",
    ),
    'other configuration': (
        lambda path: spoil_description(
            path, configuration={**CONFIGURATION, 'face_scaling': 'standardised'}
        ),
        "made with face_scaling = 'standardised', here it is 'centred'",
    ),
    'unknown setting': (
        lambda path: spoil_description(path, configuration={**CONFIGURATION, 'layers': 4}),
        'made with layers = 4, here it is None',
    ),
    'no configuration': (
        lambda path: spoil_description(path, configuration=None),
        'does not say how its learner was configured',
    ),
    'other size': (
        lambda path: spoil_arrays(path, hidden_biases=np.zeros(3, np.float32)),
        'hidden_biases must be float32 of shape (7,), found float32 of shape (3,)',
    ),
    'not a number': (
        lambda path: spoil_arrays(path, hidden_biases=np.full(7, np.nan, np.float32)),
        'hidden_biases must hold numbers from -1e+06 to 1e+06',
    ),
}


@pytest.mark.parametrize(('spoil', 'sentence'), SPOILED.values(), ids=SPOILED)
def test_what_cannot_be_used_is_refused_and_the_one_before_it_is_taken(folder, spoil, sentence):
    good = trained(4)
    before = folder.save(good)
    newest = folder.save(trained(5))
    spoil(newest)
    resumed = untrained(seed=9)
    path, [refused] = folder.resume_into(resumed)
    assert path == before
    assert str(newest) in refused
    assert sentence in refused
    assert '\n' not in refused
    assert same(resumed, good)
    assert folder.save(resumed).name == 'paper-000003.npz', 'what was refused is not written over'


def test_when_none_can_be_used_no_learner_starts_from_initial_weights_unnoticed(folder):
    for _ in range(2):
        spoil_by_cutting(folder.save(trained()))
    learner = untrained(seed=9)
    with pytest.raises(ConfigError, match=r'none of the 2 checkpoints .* newest: .*000002'):
        folder.resume_into(learner)
    assert same(learner, untrained(seed=9))


def test_one_process_at_a_time_has_the_folder(folder):
    with pytest.raises(ConfigError, match='another learner keeps its checkpoints there'):
        reopened(folder.folder)
    folder.close()
    reopened(folder.folder).close()


def test_what_a_killed_writer_left_is_removed(folder):
    left = folder.folder / '.paper-000001.npz.4711'
    left.write_bytes(b'half')
    folder.close()
    reopened(folder.folder).close()
    assert not left.exists()


def test_a_file_system_without_links_will_do(folder, monkeypatch):
    def no_links(*_args, **_kwargs):
        raise PermissionError(1, 'Operation not permitted')

    monkeypatch.setattr(Path, 'symlink_to', no_links)
    folder.save(trained())
    assert names(folder) == ['paper-000001.npz']


def test_a_full_disk_costs_nothing_that_was_saved(folder, monkeypatch):
    good = trained()
    path = folder.save(good)

    def full(*_args, **_kwargs):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(np, 'savez', full)
    with pytest.raises(OSError, match='No space left'):
        folder.save(trained(5))
    resumed = untrained(seed=9)
    assert folder.resume_into(resumed) == Resumed(path, [])
    assert same(resumed, good)


def test_what_a_reset_forgot_can_be_had_back(folder):
    before = trained(5)
    folder.save(before)
    folder.save_reset(untrained())
    resumed = untrained(seed=9)
    folder.resume_into(resumed)
    assert resumed.trials == 0, 'a restart stays reset'
    path, _ = folder.go_back(resumed)
    assert same(resumed, before)
    assert path.name == 'paper-000001.npz'
    restarted = untrained(seed=9)
    folder.resume_into(restarted)
    assert same(restarted, before), 'a restart goes on from what was brought back'


def test_a_reset_removes_nothing_even_where_one_checkpoint_is_kept(tmp_path):
    folder = CheckpointFolder(tmp_path, CheckpointConfig(checkpoints_kept=1))
    folder.save(trained(5))
    folder.save_reset(untrained())
    assert folder.go_back(learner := untrained()).path
    assert learner.trials == 5
    folder.close()


def test_going_back_takes_the_newest_where_it_has_trials_or_none_has(folder):
    assert folder.go_back(untrained()) == Resumed(None, [])
    folder.save_reset(untrained())
    newest = folder.save_reset(reset := untrained(seed=3))
    assert folder.go_back(learner := untrained()).path == newest
    assert same(learner, reset)
    folder.save(trained(5))
    newest = folder.save(trained(8))
    assert folder.go_back(learner) == Resumed(newest, [])
    assert learner.trials == 8


def test_it_is_saved_every_so_many_trials_and_at_the_end_if_need_be(tmp_path):
    folder = reopened(tmp_path, checkpoint_every_trials=4)
    learner = untrained()
    saved = []
    for number in range(10):
        learner.update(trial(number))
        folder.save_when_due(learner)
        saved.append(len(names(folder)[1:]))
    assert saved == [0, 0, 0, 1, 1, 1, 1, 2, 2, 2]
    for _ in range(2):
        folder.save_when_changed(learner)
    assert len(names(folder)[1:]) == 3
    folder.close()


def test_a_resumed_learner_is_saved_when_so_many_more_were_learned(tmp_path):
    folder = reopened(tmp_path, checkpoint_every_trials=4)
    folder.save(trained(6))
    learner = untrained()
    folder.resume_into(learner)
    folder.save_when_changed(learner)
    assert len(names(folder)[1:]) == 1
    for number in range(4):
        learner.update(trial(number))
        folder.save_when_due(learner)
    assert len(names(folder)[1:]) == 2
    folder.close()


def test_a_file_from_before_a_setting_existed_was_made_with_its_default(folder):
    path = folder.save(trained(3))
    older = {name: value for name, value in CONFIGURATION.items() if name != 'momentum'}
    spoil_description(path, configuration=older)
    assert folder.resume_into(untrained()) == Resumed(path, [])
    with pytest.raises(ConfigError, match=re.escape('made with momentum = 0.5, here it is 0.1')):
        folder.resume_into(untrained(momentum=0.1))
