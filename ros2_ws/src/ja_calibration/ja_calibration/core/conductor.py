"""Leads a head through the course: where to aim now, and when an order has been carried out."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_calibration.core.course import Calibration, Course, Rest, Sway
from ja_calibration.core.lag import Swayed
from ja_calibration.core.views import View, mean_view

_SETTLED_S = 0.4
"""So long after its command a joint is taken to stand still."""

_PICTURES_AT_REST = 6
_THERE_RAD = 0.005


class Conductor:
    """To be told commands, joint states and views; tells the aim, until `found` is there.

    `step` once a control period. Stamps are those of the joint states; now_s is any clock.
    """

    def __init__(self, course: Course) -> None:
        self._course = course
        self.found: Calibration | None = None
        self.orders_done = 0
        self._order: Rest | Sway
        self._views: list[View]
        self._stamps_ns: list[int]
        self._pan: list[float]
        self._there_since_s: float | None
        self._settled_ns: int | None
        self._swings_done: int
        self._begin(next(course))

    @property
    def aim(self) -> NDArray[np.float64]:
        """Where the head shall go now, (2,) [rad]."""
        order = self._order
        if isinstance(order, Rest):
            return order.angles
        side = 1.0 if self._swings_done % 2 == 0 else -1.0
        return order.angles + np.array([side * order.amplitude_rad, 0.0])

    @property
    def speed_rad_s(self) -> float:
        """How fast."""
        return self._order.speed_rad_s

    @property
    def watches(self) -> bool:
        """Is a picture of now of any use?"""
        return not isinstance(self._order, Rest) or self._settled_ns is not None

    def hear_joints(self, stamp_ns: int, angles: ArrayLike) -> None:
        """What the encoders said, (2,) [rad]."""
        self._stamps_ns.append(stamp_ns)
        self._pan.append(float(np.asarray(angles)[0]))

    def see(self, grey: NDArray[np.uint8], stamp_ns: int, angles: NDArray[np.float64]) -> None:
        """A picture (H, W), and the joints' angles (2,) [rad] at its stamp."""
        if isinstance(self._order, Rest):
            if self._settled_ns is not None and stamp_ns > self._settled_ns:
                self._views.append(View(grey, stamp_ns, angles))
        else:
            self._views.append(View(grey, stamp_ns, angles))

    def repeat(self) -> None:
        """Begin the order again: the head was held meanwhile."""
        self._begin(self._order)

    def step(self, now_s: float, commanded: ArrayLike, velocity: ArrayLike) -> None:
        """What the head was commanded last, (2,) [rad] and [rad/s].

        Raises ValueError when the picture does not allow a calibration.
        """
        there = np.all(np.abs(np.asarray(commanded) - self.aim) < _THERE_RAD)
        if self.found is not None or not there or np.any(velocity):
            self._there_since_s = None
            return
        if self._there_since_s is None:
            self._there_since_s = now_s
        if isinstance(self._order, Rest):
            self._rest(now_s)
        else:
            self._swings_done += 1
            self._there_since_s = None
            if self._swings_done > self._order.swings:  # the first is the way to the one end
                self._answer(Swayed(self._views, self._stamps_ns, self._pan))

    def _rest(self, now_s: float) -> None:
        assert isinstance(self._order, Rest)
        assert self._there_since_s is not None
        settled = now_s - self._there_since_s >= _SETTLED_S
        if settled and self._settled_ns is None and self._stamps_ns:
            self._settled_ns = self._stamps_ns[-1]
        if len(self._views) >= _PICTURES_AT_REST:
            self._answer(mean_view(self._views))

    def _answer(self, answer: View | Swayed) -> None:
        self.orders_done += 1
        try:
            self._begin(self._course.send(answer))
        except StopIteration as end:
            self.found = end.value

    def _begin(self, order: Rest | Sway) -> None:
        self._order = order
        self._views, self._stamps_ns, self._pan = [], [], []
        self._there_since_s = self._settled_ns = None
        self._swings_done = 0
