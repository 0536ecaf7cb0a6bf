"""Steps a head through the moves of a calibration: the target now, and when a move is done."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_calibration.core.calibration_moves import (
    Calibration,
    CalibrationMoves,
    StepMove,
    SweepMove,
)
from ja_calibration.core.lag import SweepRecord
from ja_calibration.core.posed_image import PosedImage, mean_image

_SETTLED_S = 0.4
"""A joint counts as standing still this long after its command does."""

_IMAGES_AT_REST = 6
_THERE_RAD = 0.005


class CalibrationSequence:
    """The move under way, and what was recorded during it; `result` is None until the last one.

    Call `step` once a control period. Stamps are those of the joint states; `now_s` is any clock.
    """

    def __init__(self, moves: CalibrationMoves) -> None:
        self._moves = moves
        self.result: Calibration | None = None
        self.moves_done = 0
        self._move: StepMove | SweepMove
        self._images: list[PosedImage]
        self._stamps_ns: list[int]
        self._pan: list[float]
        self._there_since_s: float | None
        self._settled_ns: int | None
        self._swings_done: int
        self._start_move(next(moves))

    @property
    def target(self) -> NDArray[np.float64]:
        """Return the posture to take now, (2,) [rad]."""
        move = self._move
        if isinstance(move, StepMove):
            return move.angles
        side = 1.0 if self._swings_done % 2 == 0 else -1.0
        return move.angles + np.array([side * move.amplitude_rad, 0.0])

    @property
    def speed_rad_s(self) -> float:
        """Return the speed limit of the current move [rad/s]."""
        return self._move.speed_rad_s

    @property
    def needs_images(self) -> bool:
        """Return whether an image taken now would be used."""
        return not isinstance(self._move, StepMove) or self._settled_ns is not None

    def record_joints(self, stamp_ns: int, angles: ArrayLike) -> None:
        """Record the encoders' angles (2,) [rad] at a stamp."""
        self._stamps_ns.append(stamp_ns)
        self._pan.append(float(np.asarray(angles)[0]))

    def record_image(
        self, grey: NDArray[np.uint8], stamp_ns: int, angles: NDArray[np.float64]
    ) -> None:
        """Record a grey image (H, W) with the joints' angles (2,) [rad] at its stamp."""
        if isinstance(self._move, StepMove):
            if self._settled_ns is not None and stamp_ns > self._settled_ns:
                self._images.append(PosedImage(grey, stamp_ns, angles))
        else:
            self._images.append(PosedImage(grey, stamp_ns, angles))

    def restart_move(self) -> None:
        """Start the current move again, for example after a hold of the head."""
        self._start_move(self._move)

    def step(self, now_s: float, commanded: ArrayLike, velocity: ArrayLike) -> None:
        """Advance by the last command: posture (2,) [rad] and velocity (2,) [rad/s].

        Raises ValueError when the images do not allow a calibration.
        """
        there = np.all(np.abs(np.asarray(commanded) - self.target) < _THERE_RAD)
        if self.result is not None or not there or np.any(velocity):
            self._there_since_s = None
            return
        if self._there_since_s is None:
            self._there_since_s = now_s
        if isinstance(self._move, StepMove):
            self._stand_still(now_s)
        else:
            self._swings_done += 1
            self._there_since_s = None
            if self._swings_done > self._move.swings:  # the first one leads to the first end
                self._finish_move(SweepRecord(self._images, self._stamps_ns, self._pan))

    def _stand_still(self, now_s: float) -> None:
        assert isinstance(self._move, StepMove)
        assert self._there_since_s is not None
        settled = now_s - self._there_since_s >= _SETTLED_S
        if settled and self._settled_ns is None and self._stamps_ns:
            self._settled_ns = self._stamps_ns[-1]
        if len(self._images) >= _IMAGES_AT_REST:
            self._finish_move(mean_image(self._images))

    def _finish_move(self, measured: PosedImage | SweepRecord) -> None:
        self.moves_done += 1
        try:
            self._start_move(self._moves.send(measured))
        except StopIteration as end:
            self.result = end.value

    def _start_move(self, move: StepMove | SweepMove) -> None:
        self._move = move
        self._images, self._stamps_ns, self._pan = [], [], []
        self._there_since_s = self._settled_ns = None
        self._swings_done = 0
