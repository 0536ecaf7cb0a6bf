"""What every learner answers to, and the choice among them."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import parameter
from ja_learning.core.gaze_line import GazeLineConfig, GazeLineLearner
from ja_learning.core.network import NetworkConfig, ThreeLayerNetwork
from ja_learning.core.trial import Trial


class Predictor(Protocol):
    """What had been learned at one instant; asking changes nothing, and any thread may ask."""

    @property
    def log_evidence(self) -> float:
        """Evidence [nats] that the face tells this learner something; 0 at first (`evidence`)."""

    def propose(
        self, face: ArrayLike, face_at: ArrayLike, posture: ArrayLike, candidates: ArrayLike
    ) -> NDArray[np.float64]:
        """Change of posture (2,) [rad].

        `face`: uint8 (30, 25), seen in the direction `face_at` (2,) [rad]; `posture` (2,): where
        the head is now; `candidates` (m, 2): directions of the objects seen in this trial.
        """

    def belief(
        self, face: ArrayLike, face_at: ArrayLike, rng: np.random.Generator, count: int
    ) -> NDArray[np.float64]:
        """Directions (count, 2) [rad] drawn from the belief about what she means."""

    def log_density(
        self, faces: ArrayLike, face_at: ArrayLike, directions: ArrayLike
    ) -> NDArray[np.float64]:
        """log p [of 1 / rad^2] of directions (m, 2) [rad] given each of faces (n, 30, 25): (n, m).

        All faces as if seen in the direction `face_at` (2,) [rad].
        """


class Learner(Predictor, Protocol):
    """Proposes where to look from what was seen, and learns from whole trials."""

    @property
    def kind(self) -> str:
        """Name of the learner, as in `LearnerChoice`."""

    @property
    def config(self) -> Any:
        """The dataclass with all its numbers."""

    trials: int
    last_error_rad: float

    def learn(self, trial: Trial) -> None:
        """Take in a finished trial."""

    def snapshot(self) -> Predictor:
        """A copy of what is believed now."""

    def state(self) -> dict[str, NDArray[Any]]:
        """Everything that learning has changed, as named arrays."""

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Take up the state of `state()`; ValueError, and no change, if it does not fit."""


@dataclass(frozen=True)
class LearnerChoice:
    """Which learner."""

    learner: str = parameter(
        ThreeLayerNetwork.kind,
        "the paper's network, or the fast one of lines of gaze; a change starts untrained",
        choices=(ThreeLayerNetwork.kind, GazeLineLearner.kind),
    )


def make_learner(
    choice: LearnerChoice, network: NetworkConfig, gaze_line: GazeLineConfig, seed: int
) -> Learner:
    """An untrained learner."""
    if choice.learner == GazeLineLearner.kind:
        return GazeLineLearner(gaze_line, seed)
    return ThreeLayerNetwork(network, seed)
