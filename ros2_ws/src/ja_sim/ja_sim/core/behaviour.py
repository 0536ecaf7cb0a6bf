"""When the caregiver looks where: the course of a trial on her side.

She looks at the robot until the robot looks at her. Then she attends to an object, after a
reaction time, and keeps attending to it until the robot looks at her again. This module needs no
geometry: the world passes how far from her face the robot looks and how fast it turns, and reads
what she attends to.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ja_sim.core.specs import CaregiverSpec

ROBOT = -1  # the attended object when it is none
# The robot has looked away when it is this many tolerances off: the same look counts once.
LEFT_AFTER_TOLERANCES = 1.5


@dataclass(frozen=True)
class GazeResponse:
    """Her response to one look of the robot at her.

    ``attended`` is the index of the attended object; ``reliable`` is False when her gaze goes
    elsewhere; ``gaze_error_rad`` (pan, tilt) is how far her eyes miss the gaze target;
    ``head_share`` is the part of the gaze angle that her head takes, her eyes take the rest.
    """

    trial: int
    attended: int
    reliable: bool
    gaze_error_rad: tuple[float, float]
    head_share: float
    head_noise_rad: tuple[float, float]


class Blinking:
    """Lids that close for a moment, at random, with a given mean rate."""

    CLOSED_S = 0.15

    def __init__(self, rate_hz: float, rng: np.random.Generator) -> None:
        self._rate_hz, self._rng = rate_hz, rng
        self._next_s = self._wait()

    def lids_closed(self, now_s: float) -> bool:
        """Return True while a blink lasts; ``now_s`` must not decrease from call to call."""
        while now_s >= self._next_s + self.CLOSED_S:
            self._next_s += self.CLOSED_S + self._wait()
        return now_s >= self._next_s

    def _wait(self) -> float:
        return self._rng.exponential(1.0 / self._rate_hz) if self._rate_hz else math.inf


class CaregiverBehaviour:
    """Counts the looks at her and decides what she attends to."""

    def __init__(self, spec: CaregiverSpec, rng: np.random.Generator) -> None:
        self._spec = spec
        self._rng = rng
        self.response = GazeResponse(0, ROBOT, True, (0.0, 0.0), 1.0, (0.0, 0.0))
        self._started_s = -math.inf  # when the present trial began
        self._armed = True  # the robot has looked elsewhere since the last look
        self._robot_stayed = True  # it has not looked away since the trial began

    def update(self, now_s: float, offset_rad: float, speed_rad_s: float, objects: int) -> bool:
        """Update with where the robot looks; return True if a new trial begins now.

        ``offset_rad`` is the angle between its camera axis and her face, ``speed_rad_s`` how fast
        its head turns, ``objects`` how many there are to choose from.
        """
        tolerance = math.radians(self._spec.eye_contact_deg)
        if offset_rad > LEFT_AFTER_TOLERANCES * tolerance:
            self._armed, self._robot_stayed = True, False
        looked_back = now_s - self._started_s > self._spec.patience_s + self._look_back_s
        if self._robot_stayed and looked_back:
            self._armed = True
        still = speed_rad_s < math.radians(self._spec.eye_contact_speed_deg_s)
        if not (self._armed and still and offset_rad < tolerance):
            return False
        self._armed, self._robot_stayed, self._started_s = False, True, now_s
        self.response = self._choose_response(objects)
        return True

    def attends_to(self, now_s: float) -> int:
        """Return the index of the object she looks at now, or ROBOT."""
        since = now_s - self._started_s
        tired_s = self._spec.patience_s if self._robot_stayed else self._spec.attention_s
        return self.response.attended if since < max(tired_s, self._spec.reaction_s) else ROBOT

    @property
    def _look_back_s(self) -> float:
        """Return how long she looks at a robot that keeps staring, before the next object [s]."""
        return self._spec.reaction_s + self._spec.turn_s

    def _choose_response(self, objects: int) -> GazeResponse:
        """Draw another object than before, and how she will turn to it."""
        rng, spec = self._rng, self._spec
        others = [index for index in range(objects) if index != self.response.attended]
        return GazeResponse(
            trial=self.response.trial + 1,
            attended=int(rng.choice(others or [0])),
            reliable=bool(rng.random() < spec.reliability),
            gaze_error_rad=self._error(spec.gaze_noise_deg),
            head_share=float(rng.uniform(*spec.head_share)),
            head_noise_rad=self._error(spec.head_noise_deg),
        )

    def _error(self, deviation_deg: float) -> tuple[float, float]:
        pan, tilt = self._rng.normal(0.0, math.radians(deviation_deg), 2)
        return float(pan), float(tilt)
