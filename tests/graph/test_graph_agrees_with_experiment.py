"""The graph over ROS and the experiment without it learn alike: minutes, `./ja test -m learning`.

Both get the settings of the demo of the paper's network. The experiment draws its looks from many
at the same caregiver, so that, as in the graph, hardly any look comes twice.
"""

import csv
import subprocess
import sys
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from scipy.stats import t

from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.looks import load_looks
from ja_experiments.paper.kernel import FastExperiment
from ja_sim.core.scene import load_scene

SEED = 3
SCENE = 'easy'
BLOCKS, BLOCK = 6, 300
RUNS = 10


def demo_settings() -> dict[str, Any]:
    """Return the parameters that the demo sets for the gate and the learner."""
    path = resources.files('ja_runner') / 'config' / 'demo_paper.yaml'
    nodes = yaml.safe_load(path.read_text(encoding='utf-8'))
    settings = {k: v for node in nodes.values() for k, v in node['ros__parameters'].items()}
    assert settings.pop('learner') == 'paper'
    return settings


def curve(success: NDArray[Any]) -> NDArray[np.float64]:
    """Return the share of successes in every block of trials."""
    return success[: BLOCKS * BLOCK].reshape(BLOCKS, BLOCK).mean(axis=1)


def graph_curve(folder: Path) -> NDArray[np.float64]:
    """Return the curve of one run of the graph in lockstep, as the demo starts it."""
    trials, most_s = str(BLOCKS * BLOCK + 1), '900'  # by trials: a busy machine learns as much
    options = ['--learner', 'paper', '--scene', SCENE, '--seed', str(SEED), '--exam', '0']
    command = [sys.executable, '-m', 'ja_bringup.cli', 'demo', *options]
    command += ['--trials', trials, '--time', most_s]
    ran = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    [path] = folder.glob('runs/*-demo/success_curve.csv')
    return curve(np.array([int(row['success']) for row in csv.DictReader(path.open())]))


def experiment_curves() -> NDArray[np.float64]:
    """Run the experiment without ROS; return its curves (runs, blocks)."""
    places = load_scene(SCENE).objects
    config = ExperimentConfig().with_settings({**demo_settings(), 'objects': places.count})
    looks = load_looks(SCENE, SEED)
    runs = [FastExperiment(config, places, looks, seed) for seed in range(RUNS)]
    return np.array([curve(run.run(BLOCKS * BLOCK).success) for run in runs])


@pytest.mark.learning
@pytest.mark.usefixtures('domain')
def test_one_run_of_the_graph_is_one_of_the_experiment(tmp_path: Path) -> None:
    graph, experiment = graph_curve(tmp_path), experiment_curves()
    mean, deviation = experiment.mean(axis=0), experiment.std(axis=0, ddof=1)
    # Where one more run lies with 99 % probability, in each of the blocks.
    half = t.ppf(0.995, RUNS - 1) * deviation * np.sqrt(1 + 1 / RUNS)
    print(f'\ngraph: {graph}, experiment: {mean}, one more run: +- {half}')
    assert np.all(np.abs(graph - mean) < half)
    assert mean[-1] - half[-1] > mean[0], 'so little is learned that agreement means nothing'
