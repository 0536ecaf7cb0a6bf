"""The score of joint attention: did the robot fixate the object that the caregiver attends to?

Only this module and the simulator know it; the robot's own nodes never subscribe to it.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ja_common.core.geometry import angle_between
from ja_common.core.statistics import Rate


@dataclass(frozen=True)
class TrialOutcome:
    """How one trial ended. Directions are (pan, tilt) [rad]; no fixation: it was given up."""

    trial: int
    stamp_ns: int
    objects: int
    in_view: bool
    attended: tuple[float, float]
    fixated: tuple[float, float] | None
    success: bool


@dataclass(frozen=True)
class TruthAt:
    """The truth at one image: which trial it is and where the objects are.

    `directions`: (n, 2) [rad] of the objects; `attended`: index of the attended object (-1: none);
    `in_view`: was it in the robot's view when the robot looked at her?
    """

    stamp_ns: int
    trial: int
    directions: np.ndarray
    attended: int
    in_view: bool


class Score:
    """Joins fixations with the truth; the first fixation of a trial decides."""

    def __init__(self, window: int = 100) -> None:
        self._truth: TruthAt | None = None
        self._is_whole = False  # the present trial was observed from its beginning
        self._began_ns = -1
        self._fixated_ns: int | None = None
        self._interrupted_ns: int | None = None  # the first time in the present trial
        self._newest_interruption_ns = -1
        self._fixated: tuple[float, float] | None = None
        self._success = False
        self._recent: deque[bool] = deque(maxlen=window)
        self._rates: dict[str, Rate] = {}

    def score_image(
        self, truth: TruthAt, fixation: NDArray[np.float64] | None
    ) -> TrialOutcome | None:
        """Score one image: truth and fixation (2,) [rad] at its stamp; return an ended trial.

        None is returned while the trial goes on. A trial ends when the next begins. Images before
        the first look (trial 0) belong to none. A trial that a reset of the world cuts off, or
        that was not observed from its beginning, does not count.
        """
        ended = None
        if self._truth is not None and truth.trial != self._truth.trial:
            if truth.trial < self._truth.trial:
                self._newest_interruption_ns = -1  # with the world its clock may be set back
            elif self._is_whole and not self._is_interrupted():
                ended = self._close(self._truth)
            self._is_whole, self._fixated, self._success = truth.trial > 0, None, False
            self._began_ns, self._fixated_ns = truth.stamp_ns, None
            newest_ns = self._newest_interruption_ns
            self._interrupted_ns = newest_ns if newest_ns >= self._began_ns else None
        self._truth = truth
        if fixation is not None and self._fixated is None:
            nearest = int(np.argmin(angle_between(truth.directions, fixation)))
            self._fixated = (float(fixation[0]), float(fixation[1]))
            self._fixated_ns = truth.stamp_ns
            self._success = nearest == truth.attended
        return ended

    def interrupt_trial(self, stamp_ns: int) -> None:
        """Do not count the trial to which the image of this stamp [ns] belongs.

        From that image on the head did not do what a trial asks for. A trial with a fixation
        is over for the robot, and counts. The image may be scored before or after this call.
        """
        self._newest_interruption_ns = stamp_ns
        if self._interrupted_ns is None and stamp_ns >= self._began_ns:
            self._interrupted_ns = stamp_ns

    def _is_interrupted(self) -> bool:
        if self._interrupted_ns is None:
            return False
        return self._fixated_ns is None or self._interrupted_ns < self._fixated_ns

    def rates(self) -> dict[str, Rate]:
        """Return rates by name: 'all', 'recent', 'in_view', 'out_of_view', and 'objects_N'."""
        return {'recent': Rate(sum(self._recent), len(self._recent)), **self._rates}

    def _close(self, truth: TruthAt) -> TrialOutcome:
        outcome = TrialOutcome(
            truth.trial,
            truth.stamp_ns,
            len(truth.directions),
            truth.in_view,
            (
                float(truth.directions[truth.attended][0]),
                float(truth.directions[truth.attended][1]),
            ),
            self._fixated,
            self._success,
        )
        self._recent.append(self._success)
        view = 'in_view' if truth.in_view else 'out_of_view'
        for name in ('all', view, f'objects_{outcome.objects}'):
            before = self._rates.get(name, Rate(0, 0))
            self._rates[name] = Rate(before.successes + self._success, before.trials + 1)
        return outcome
