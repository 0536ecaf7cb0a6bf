"""The interface of every learner. Importing it loads no learner (`learner_registry` does)."""

from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_learning.core.trial import Trial


class Predictor(Protocol):
    """What had been learned at one instant; a question changes nothing, and any thread may ask."""

    @property
    def log_evidence(self) -> float:
        """Return the evidence [nats] that the face informs the learner; at first 0."""

    def propose(
        self, face: ArrayLike, face_at: ArrayLike, posture: ArrayLike, candidates: ArrayLike
    ) -> NDArray[np.float64]:
        """Return a change of posture (2,) [rad] towards the gaze target.

        `face`: uint8 (30, 25), seen in the direction `face_at` (2,) [rad]; `posture` (2,): where
        the head is now; `candidates` (m, 2): directions of the objects seen in this trial.
        """

    def belief(
        self, face: ArrayLike, face_at: ArrayLike, rng: np.random.Generator, count: int
    ) -> NDArray[np.float64]:
        """Draw directions (count, 2) [rad] from the belief about the gaze target."""


class TrainablePredictor(Predictor, Protocol):
    """A predictor that learns: all that a trial pipeline needs."""

    def update(self, trial: Trial) -> None:
        """Learn from one finished trial."""


class Learner(TrainablePredictor, Protocol):
    """A learner with all that a node needs: a snapshot for other threads, a state for a file."""

    @property
    def kind(self) -> str:
        """Return the name of the learner, as in `LearnerChoice`."""

    @property
    def config(self) -> Any:
        """Return the configuration dataclass with all its numbers."""

    trials: int
    last_error_rad: float

    def snapshot(self) -> Predictor:
        """Copy what is believed now."""

    def state(self) -> dict[str, NDArray[Any]]:
        """Return everything that learning has changed, as named arrays."""

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Take the state of `state()`; ValueError, and no change, if it does not fit."""
