"""Does the face show where she looks? Evidence from the robot's own trials, without any label.

Before a trial is learned, the learner's belief gives the probability of what was seen, given the
face of this trial, and given the faces of other trials. If the face carried no information, all of
them would do equally well on average, so that

    ratio = p(seen | this face) / mean over this face and the others of p(seen | face)

has the mean 1: an e-value (Vovk and Wang 2021). The product over trials is a Bayes factor of 'the
learner knows something' against 'chance', and only with a probability of 1 / 20 is it ever beyond
20 by chance. Old trials fade, so that the evidence falls again when the world has changed.

What was seen must not depend on what the learner inferred from the face, or it would confirm its
own guesses. Only what was seen before the first shift counts (`Trial.seen_before_shift`).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ja_learning.core.checkpoint_arrays import numbers
from ja_learning.core.trial import PICTURE, FaceFormat

_OTHERS = 15
_FADES_OVER_TRIALS = 100.0
# A caregiver who often looks elsewhere raises doubt, too, but hardly ever this much.
_DOUBT_OF_A_CHANGE = 25.0
# A mixture with 1, itself an e-value: one trial without a gaze target may not undo ten others.
_SHARE_OF_CHANCE = 0.1


class Evidence:
    """Faded sum of log ratios [nats], of one belief or of several side by side."""

    def __init__(
        self, beliefs: int = 1, faces: FaceFormat = PICTURE, fewest_others: int = _OTHERS
    ) -> None:
        """Start with no evidence for any of so many beliefs about faces of this format.

        `fewest_others`: with how many faces of other trials weighing begins.
        """
        self._fewest_others = fewest_others
        self.nats: NDArray[np.float64] = np.zeros(beliefs)
        self._faces = faces
        self._others: list[NDArray[Any]] = []

    def weigh_trial(
        self,
        face: NDArray[Any],
        log_probability: Callable[[NDArray[Any]], NDArray[np.float64]],
    ) -> NDArray[np.float64]:
        """Weigh one trial, not learned yet; return its log ratios (beliefs,) [nats].

        `log_probability` returns, for n faces, how probable each makes what was seen, on
        one scale, shape (beliefs, n).
        """
        ratios = np.zeros_like(self.nats)
        if len(self._others) >= self._fewest_others:
            log_p = log_probability(np.array([face, *self._others]))
            ratio = np.exp(log_p[:, 0] - np.logaddexp.reduce(log_p, axis=1)) * log_p.shape[1]
            ratios = np.log((1 - _SHARE_OF_CHANCE) * ratio + _SHARE_OF_CHANCE)
            self.nats = self.nats * (1 - 1 / _FADES_OVER_TRIALS) + ratios
        self._others = [*self._others, face][-_OTHERS:]
        return ratios

    def state(self) -> dict[str, NDArray]:
        """Return everything that weighing has changed, as named arrays."""
        faces = np.array(self._others, self._faces.dtype).reshape(-1, *self._faces.shape)
        return {'evidence.nats': self.nats.copy(), 'evidence.faces': faces}

    def restore(self, arrays: dict[str, NDArray]) -> None:
        """Take the state of `state()`; ValueError, and no change, if it misfits."""
        nats = numbers(arrays, 'evidence.nats', self.nats.shape, np.float64)
        known = min(len(np.atleast_1d(arrays.get('evidence.faces', ()))), _OTHERS)
        faces = numbers(arrays, 'evidence.faces', (known, *self._faces.shape), self._faces.dtype)
        self.nats, self._others = nats, list(faces)


class ChangeAlarm:
    """A detector of changes of the world: the cumulative sum (Page 1954) of a learner's losses.

    The doubt [nats] grows with the evidence of a trial against the learner, and is never below
    zero. The trials since it was last zero are those since the change.
    """

    def __init__(self) -> None:
        """Start without doubt."""
        self.doubt = 0.0
        self.doubtful_trials = 0

    def add_log_ratio(self, log_ratio: float, knew: bool) -> bool:
        """Add a trial's log ratio [nats]; return whether it shows a change.

        `knew`: whether the learner knew something before this trial.
        """
        if self.doubt == 0.0:
            self.doubtful_trials = 0
            if not knew:
                return False
        self.doubt = max(0.0, self.doubt - log_ratio)
        self.doubtful_trials += 1
        return self.doubt > _DOUBT_OF_A_CHANGE

    def reset(self) -> None:
        """Start again without doubt: the learner was re-initialised."""
        self.doubt, self.doubtful_trials = 0.0, 0
