"""The Gymnasium environment: its own checker passes, and the reward is right."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import ja_sim.gym_env


@pytest.fixture
def env():
    made = gymnasium.make('JointAttention-v0', image_size=(80, 60), render_mode='rgb_array')
    yield made
    made.close()


@pytest.mark.filterwarnings('ignore:.*recommend using a symmetric:UserWarning')
def test_gymnasium_finds_no_fault(env):
    check_env(env.unwrapped)


def truth(env):
    return env.unwrapped._world.truth()


def shift_to(env, index: int, observation):
    action = truth(env).directions[index] - observation['posture']
    return env.step(action.astype(np.float32))


def test_the_attended_object_is_rewarded_and_ends_the_episode(env):
    for episode in range(5):
        observation, _ = env.reset(seed=2 if episode == 0 else None)
        _, reward, terminated, truncated, info = shift_to(env, truth(env).attended, observation)
        assert (reward, terminated, truncated) == (1.0, True, False)
        assert info['fixated'] == info['attended']


def test_another_object_ends_it_without_reward(env):
    observation, _ = env.reset(seed=2)
    other = (truth(env).attended + 1) % 5
    _, reward, terminated, _, info = shift_to(env, other, observation)
    assert (reward, terminated) == (0.0, True)
    assert info['fixated'] == other


def test_who_never_finds_anything_is_stopped(env):
    env.reset(seed=2)
    for shift in range(10):
        _, reward, terminated, truncated, _ = env.step(np.zeros(2, np.float32))
        assert (reward, terminated) == (0.0, False)
        assert truncated == (shift == 9)


def test_each_episode_is_another_look_in_the_same_world(env):
    _, first = env.reset(seed=2)
    _, second = env.reset()
    assert (first['trial'], second['trial']) == (1, 2)
    assert ja_sim.gym_env.ENV_ID in gymnasium.registry


def test_a_process_that_knows_nothing_of_it_finds_it_by_its_module():
    code = "import gymnasium; gymnasium.make('ja_sim.gym_env:JointAttention-v0', scene='easy')"
    ran = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
