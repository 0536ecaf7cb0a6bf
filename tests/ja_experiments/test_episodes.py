"""Episodes of a trained network in the rendered world."""

import numpy as np

from ja_experiments.paper.episodes import FrozenNetwork
from ja_learning.core.network import ThreeLayerNetwork
from ja_learning.core.network_config import NetworkConfig
from synthetic_trials import synthetic_samples


def test_a_frozen_network_does_not_learn() -> None:
    network = ThreeLayerNetwork(NetworkConfig(), seed=0)
    frozen = FrozenNetwork(network)
    trial = synthetic_samples()[0].trial
    frozen.update(trial)
    for name, array in network.state().items():
        np.testing.assert_array_equal(frozen.state()[name], array, err_msg=name)
    network.update(trial)
    weights = (each.state()['hidden_weights'] for each in (network, frozen))
    assert not np.array_equal(*weights)
