"""The learners of the project live in the Gymnasium world, too."""

import gymnasium
import numpy as np
import pytest

from ja_experiments.agents.gym_agent import GymAgent
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.learner_registry import make_learner


@pytest.mark.parametrize('kind', ['paper', 'gaze_line'])
def test_a_learner_learns_from_the_episodes_it_ends(kind):
    small = GazeLineConfig(members=2, channels=2)
    learner = make_learner(kind, 0, small if kind == 'gaze_line' else None)
    agent = GymAgent(learner, p_lm=0.0, seed=0)
    env = gymnasium.make(
        'ja_sim.gym_env:JointAttention-v0', scene='easy', image_size=(160, 120), max_shifts=3
    )
    ended = 0
    for episode in range(6):
        observation, info = env.reset(seed=1 if episode == 0 else None)
        over = fixated = False
        while not over:
            action = agent.act(observation, info)
            assert np.isfinite(action).all()
            observation, _, fixated, given_up, info = env.step(action.astype(np.float32))
            over = fixated or given_up
        agent.act(observation, info)  # it sees where the last shift has led
        ended += fixated
    env.close()
    assert ended >= 4, 'visual feedback ends most episodes on some object'
    assert learner.trials >= 4
