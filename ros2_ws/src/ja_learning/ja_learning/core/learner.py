"""What every learner answers to, and the choice among them."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import parameter
from ja_learning.core.gaze_line import GazeLineConfig, GazeLineLearner
from ja_learning.core.network import NetworkConfig, ThreeLayerNetwork
from ja_learning.core.trial import Trial


class Learner(Protocol):
    """Proposes where to look from what was seen, and learns from whole trials."""

    @property
    def kind(self) -> str:
        """Name of the learner, as in `LearnerChoice`."""

    trials: int
    last_error_rad: float

    def propose(
        self, face: ArrayLike, look: ArrayLike, posture: ArrayLike, candidates: ArrayLike
    ) -> NDArray[np.float64]:
        """Change of posture (2,) [rad].

        `face`: uint8 (30, 25), seen from the posture `look` (2,) [rad]; `posture` (2,): where the
        head is now; `candidates` (m, 2): directions of the objects seen in this trial.
        """

    def belief(
        self, face: ArrayLike, look: ArrayLike, rng: np.random.Generator, count: int
    ) -> NDArray[np.float64]:
        """Directions (n, 2) [rad] drawn from the belief about what she means; n <= count."""

    def learn(self, trial: Trial) -> None:
        """Take in a finished trial."""

    def state(self) -> dict[str, NDArray[Any]]:
        """Everything that learning has changed, as named arrays."""

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Take up the state of `state()`; ValueError, and no change, if it does not fit."""


@dataclass(frozen=True)
class LearnerChoice:
    """Which learner."""

    learner: str = parameter(
        ThreeLayerNetwork.kind,
        "the paper's network, or the fast one of lines of gaze; a change starts untaught",
        choices=(ThreeLayerNetwork.kind, GazeLineLearner.kind),
    )


def make_learner(
    choice: LearnerChoice, network: NetworkConfig, gaze_line: GazeLineConfig, seed: int
) -> Learner:
    """An untaught learner."""
    if choice.learner == GazeLineLearner.kind:
        return GazeLineLearner(gaze_line, seed)
    return ThreeLayerNetwork(network, seed)
