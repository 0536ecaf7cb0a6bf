"""`kill -9` at any instant: a good checkpoint is there, and few trials are lost."""

import time
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import pytest

from ja_learning.core.checkpoint_folder import CheckpointConfig, CheckpointFolder
from ja_learning.core.gaze_line import GazeLineLearner
from ja_learning.core.gaze_line_config import GazeLineConfig
from made_up_trials import trial

KILLS = 50
EVERY_TRIALS = 3
CONFIG = CheckpointConfig(checkpoint_every_trials=EVERY_TRIALS, checkpoints_kept=2)
LONGEST_RUN_S = 0.6

pytestmark = pytest.mark.slow


def untrained() -> GazeLineLearner:
    return GazeLineLearner(GazeLineConfig(replay_steps=1), seed=0)


def learn_until_killed(folder: Path, counts: Connection) -> None:
    """Resume; learn, save and send the count of trials, until killed."""
    learner = untrained()
    checkpoints = CheckpointFolder(folder, CONFIG)
    checkpoints.resume_into(learner)
    counts.send(learner.trials)
    while True:
        learner.update(trial(learner.trials))
        counts.send(learner.trials)
        checkpoints.save_when_due(learner)


def test_fifty_kills_cost_few_trials_each_and_nothing_else(tmp_path):
    random = np.random.default_rng(0)
    # Its children are made quickly: the server has imported everything already.
    processes = get_context('forkserver')
    processes.set_forkserver_preload(['ja_learning.core.gaze_line', 'made_up_trials'])
    saved, died_writing = 0, 0
    for _ in range(KILLS):
        received, counts = processes.Pipe(duplex=False)
        process = processes.Process(
            target=learn_until_killed, args=(tmp_path, counts), daemon=True
        )
        process.start()
        counts.close()
        assert received.recv() == saved, 'it goes on from the newest checkpoint'
        time.sleep(random.uniform(0.0, LONGEST_RUN_S))
        process.kill()
        process.join()
        learned = last_count(received, saved)
        died_writing += bool(list(tmp_path.glob('.*.npz.*')))
        resumed = untrained()
        checkpoints = CheckpointFolder(tmp_path, CONFIG)
        assert checkpoints.resume_into(resumed).refused == [], 'every file that is there is whole'
        checkpoints.close()
        assert resumed.trials >= max(saved, learned - EVERY_TRIALS)
        saved = resumed.trials
    assert died_writing, 'no kill fell into the writing of a file: the test is too tame'
    assert saved > KILLS
    assert_same_state(resumed, uninterrupted(saved))


def last_count(received: Connection, count: int) -> int:
    """Return the count of trials that was sent last before the end."""
    try:
        while True:
            count = received.recv()
    except EOFError:
        return count


def uninterrupted(trials: int) -> GazeLineLearner:
    learner = untrained()
    for number in range(trials):
        learner.update(trial(number))
    return learner


def assert_same_state(one: GazeLineLearner, other: GazeLineLearner) -> None:
    ours, tresumeds = one.state(), other.state()
    assert ours.keys() == tresumeds.keys()
    for name in ours:
        np.testing.assert_array_equal(ours[name], tresumeds[name], err_msg=name)
