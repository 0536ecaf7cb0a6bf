"""The interface of every learner. Importing it loads no learner (`learner_registry` does)."""

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_learning.core.trial import Look, MeanFace, Trial


class Predictor(Protocol):
    """What had been learned at one instant; a question changes nothing, and any thread may ask."""

    @property
    def log_evidence(self) -> float:
        """Return the evidence [nats] that the face informs the learner; at first 0."""

    def propose(
        self,
        look: Look,
        posture: ArrayLike,
        candidates: ArrayLike,
        ranges: ArrayLike | None = None,
    ) -> NDArray[np.float64] | None:
        """Return a change of posture (2,) [rad] towards the gaze target.

        `posture` (2,): where the head is now; `candidates` (m, 2): directions of the objects seen
        in this trial; `ranges` (m, 2) [m]: as in `Trial`. None where the look shows this learner
        nothing: no landmarks were read, and it reads nothing else.
        """

    def belief(self, look: Look, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Draw directions (count, 2) [rad] from the belief about the gaze target.

        (0, 2) where the look shows this learner nothing.
        """


@runtime_checkable
class KnowsItsGain(Protocol):
    """A predictor that may know how good its proposals are; others need not have this."""

    def expected_gain(
        self, look: Look, candidates: ArrayLike, ranges: ArrayLike | None = None
    ) -> float:
        """Return how much better than a choice by chance its choice is, by what it believes.

        0: not at all, 1: it is sure. NaN where it does not know that, or fewer than two objects
        are seen. Arguments as in `propose`.
        """


@runtime_checkable
class KnowsAPerson(Protocol):
    """A learner that keeps the mean face of a person; others need not have this."""

    @property
    def mean_face(self) -> MeanFace | None:
        """Return that of the person of whom it has learned last, if any."""


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
