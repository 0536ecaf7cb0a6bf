"""Does the face tell where she looks? Evidence from the robot's own trials, with nobody's help.

Before a trial is learned, the learner's belief is asked: how probable is what was seen, given the
face of this trial, and given the faces of other trials? If the face told nothing, all of them
would do equally well on average, so that

    ratio = p(seen | this face) / mean over this face and the others of p(seen | face)

has the mean 1: an e-value (Vovk and Wang 2021). The product over trials is a Bayes factor of 'the
learner knows something' against 'chance', and only with a probability of 1 / 20 is it ever beyond
20 by chance. Old trials fade, so that the evidence falls again when the world has changed.

What was seen must not depend on what the learner made of the face, or it would find its own
guesses confirmed: only what was seen before the first shift counts (`Trial.seen_before_shift`).
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ja_learning.core.trial import FACE_SHAPE

_OTHERS = 15
_FADES_OVER_TRIALS = 100.0
# A caregiver who is often elsewhere raises doubt, too; this much she hardly ever does.
_DOUBT_OF_A_CHANGE = 25.0
# A mixture with 1, itself an e-value: one trial in which none was meant may not undo ten others.
_SHARE_OF_CHANCE = 0.1


class Evidence:
    """Faded sum of log ratios [nats], of one belief or of several side by side."""

    def __init__(self, beliefs: int = 1) -> None:
        self.nats: NDArray[np.float64] = np.zeros(beliefs)
        self._others: list[NDArray[np.uint8]] = []

    def weigh(
        self,
        face: NDArray[np.uint8],
        log_probability: Callable[[NDArray[np.uint8]], NDArray[np.float64]],
    ) -> NDArray[np.float64]:
        """Weigh one trial, not learned yet; log ratios (beliefs,) [nats] of this trial.

        `log_probability` says of faces (n, 30, 25) how probable each makes what was seen, on the
        same scale, shape (beliefs, n).
        """
        ratios = np.zeros_like(self.nats)
        if len(self._others) == _OTHERS:
            log_p = log_probability(np.array([face, *self._others]))
            ratio = np.exp(log_p[:, 0] - np.logaddexp.reduce(log_p, axis=1)) * (1 + _OTHERS)
            ratios = np.log((1 - _SHARE_OF_CHANCE) * ratio + _SHARE_OF_CHANCE)
            self.nats = self.nats * (1 - 1 / _FADES_OVER_TRIALS) + ratios
        self._others = [*self._others, face][-_OTHERS:]
        return ratios

    def state(self) -> dict[str, NDArray]:
        """Everything that weighing has changed, as named arrays."""
        faces = np.array(self._others, np.uint8).reshape(-1, *FACE_SHAPE)
        return {'evidence.nats': self.nats.copy(), 'evidence.faces': faces}

    def restore(self, arrays: dict[str, NDArray]) -> None:
        """Take up the state of `state()`; KeyError or ValueError, and no change, if it misfits."""
        nats, faces = arrays['evidence.nats'], arrays['evidence.faces']
        if nats.shape != self.nats.shape or not np.isfinite(nats).all():
            raise ValueError(f'evidence must be {len(self.nats)} finite numbers, found {nats}')
        if faces.dtype != np.uint8 or faces.shape != (min(len(faces), _OTHERS), *FACE_SHAPE):
            raise ValueError(f'evidence cannot be over faces of shape {faces.shape}')
        self.nats, self._others = nats.astype(float), list(faces.copy())


class ChangeAlarm:
    """Has the world changed under a learner that knew? A cumulative sum (Page 1954) of its losses.

    The doubt [nats] grows by what a trial says against the learner, and is never below zero; the
    trials since it was last zero are those since the change.
    """

    def __init__(self) -> None:
        self.doubt = 0.0
        self.doubtful_trials = 0

    def raised_by(self, log_ratio: float, knew: bool) -> bool:
        """Take in a trial's log ratio [nats]; is it a change? `knew`: it knew before."""
        if self.doubt == 0.0:
            self.doubtful_trials = 0
            if not knew:
                return False
        self.doubt = max(0.0, self.doubt - log_ratio)
        self.doubtful_trials += 1
        return self.doubt > _DOUBT_OF_A_CHANGE

    def reset(self) -> None:
        """The learner begins anew."""
        self.doubt, self.doubtful_trials = 0.0, 0
