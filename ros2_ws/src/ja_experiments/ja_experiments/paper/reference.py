"""The experiment of section 3, one image at a time, through the same cores as the nodes.

This is the readable version; `kernel.py` computes the same, several hundred times faster.
"""

from __future__ import annotations

from ja_experiments.agents.trial_loop import TrialLoop
from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.looks import Looks
from ja_learning.core.network import ThreeLayerNetwork
from ja_sim.core.specs import ObjectsSpec


class ReferenceExperiment(TrialLoop):
    """A trial loop with the paper's network, `network`."""

    def __init__(
        self, config: ExperimentConfig, places: ObjectsSpec, looks: Looks, seed: int
    ) -> None:
        self.network = ThreeLayerNetwork(config.network, seed)
        super().__init__(config, places, looks, self.network, seed)
