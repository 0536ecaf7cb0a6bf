"""Which way to glance before the shift: an object that is never seen can never be chosen.

A glance is a look to a side, too short to be a fixation. It shows objects outside the first view,
so that the learner may choose among more of them, and learn from more of them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import Configuration, parameter
from ja_learning.core.trial import same_posture

AT_A_VIEW_RAD = 0.05
"""The head has taken a view when it rests nearer to it than this in both joints."""


@dataclass(frozen=True)
class LookAroundConfig(Configuration):
    """When to glance, and where to."""

    look_around: str = parameter(
        'off',
        'glances before the shift: none, to both sides, or, once the learner knows something, '
        'only where the gaze target may well be and has not been in view',
        choices=('off', 'both_sides', 'where_worthwhile'),
    )
    glance_pan_rad: float = parameter(
        0.45, 'how far to either side of the caregiver a glance goes', low=0.05, high=3.0
    )
    glance_view_rad: float = parameter(
        0.3, 'half of the horizontal field of view', low=0.02, high=1.5
    )
    knows_above_nats: float = parameter(
        20.0, 'log evidence above which the learner knows something', low=-50.0, high=50.0
    )
    glance_worth: float = parameter(
        0.1,
        'a side is worth a glance when the gaze target would be newly seen there with this '
        'probability',
        low=0.0, high=1.0,
    )  # fmt: skip


class LookAround:
    """The views of one trial: those taken, and those still to be taken."""

    def __init__(self, config: LookAroundConfig) -> None:
        self._config = config
        self._taken: list[NDArray[np.float64]] = []
        self._left: list[NDArray[np.float64]] = []
        self._everywhere = False

    def start_trial(self, look: ArrayLike, log_evidence: float) -> None:
        """Start over: the head looks at the caregiver from this posture (2,) [rad].

        `log_evidence` [nats]: that the learner knows something. A learner that knows nothing must
        look everywhere, or it would never see gaze targets outside the first view.
        """
        c = self._config
        self._everywhere = c.look_around == 'both_sides' or log_evidence < c.knows_above_nats
        self._taken = [np.array(look, float)]
        self._left = []
        if self._config.look_around != 'off':
            aside = self._config.glance_pan_rad
            self._left = [self._taken[0] + [pan, 0.0] for pan in (aside, -aside)]

    def observe_rest(self, posture: ArrayLike) -> bool:
        """Note that the head rests at a posture (2,) [rad]; return whether it got there blindly.

        Blindly means: not led by the face. This holds at the look and, if both sides are taken in
        any case, at the sides. A rest anywhere else is a shift, which ends the glances.
        """
        for view in self._left:
            if _near(view, posture):
                self._taken.append(view)
                self._left = [other for other in self._left if other is not view]
        if not any(_near(view, posture) for view in self._taken):
            self._left = []
            return False
        return self._everywhere or _near(self._taken[0], posture)

    def next_view(self, believed: Callable[[], NDArray[np.float64]]) -> NDArray[np.float64] | None:
        """Return the next view (2,) [rad] that is worth its time, or None.

        `believed` draws directions (n, 2) [rad] of the gaze target; called only where it decides.
        """
        if not self._left or self._everywhere:
            return next(iter(self._left), None)
        directions = believed()
        unseen = ~np.any([self._in_view(view, directions) for view in self._taken], axis=0)
        worth = [float(np.mean(unseen & self._in_view(side, directions))) for side in self._left]
        if max(worth) < self._config.glance_worth:
            self._left = []
            return None
        return self._left[int(np.argmax(worth))]

    def _in_view(
        self, view: NDArray[np.float64], directions: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        return np.abs(directions[:, 0] - view[0]) < self._config.glance_view_rad


def _near(view: NDArray[np.float64], posture: ArrayLike) -> bool:
    return same_posture(view, posture, AT_A_VIEW_RAD)
