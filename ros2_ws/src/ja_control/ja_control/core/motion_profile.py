"""The trapezoidal motion profile of one joint, in steps of a fixed period.

Every period of h seconds the velocity v becomes v' and the position p becomes p + v' h, with
|v'| <= V and |v' - v| <= A h. A speed that only grows while the joint can still stop before a
position never passes that position, whatever the targets were meanwhile.
"""

import math


def stopping_speed(distance: float, speed_step: float, period_s: float) -> float:
    """Return the largest speed for the next period from which a joint stops within `distance`.

    Speeds fall by at most `speed_step` (= A h) a period. With the speed m = n + f in units of A h
    (n whole, 0 <= f < 1) the distance to a stop is A h^2 (n (n + 1) / 2 + f (n + 1)); this is its
    inverse. A distance that is not finite has no stopping speed but 0.
    """
    if not 0.0 < distance < math.inf:
        return 0.0
    scaled = distance / (speed_step * period_s)
    n = math.floor((math.sqrt(8.0 * scaled + 1.0) - 1.0) / 2.0)
    return speed_step * (n + (scaled - n * (n + 1) / 2.0) / (n + 1))


class MotionProfile:
    """Position [rad] and velocity [rad/s] of one commanded joint; it starts at rest."""

    def __init__(
        self, period_s: float, max_speed: float, max_acceleration: float, position: float = 0.0
    ) -> None:
        self.position = position
        self.velocity = 0.0
        self._period_s = period_s
        self._max_speed = max_speed
        self._speed_step = max_acceleration * period_s

    def approach(self, target: float) -> str:
        """Move one period towards a target, and return the limit that cut the motion, or ''.

        A target inside the braking distance is passed and returned to.
        """
        gap = target - self.position
        free = stopping_speed(abs(gap), self._speed_step, self._period_s)
        wanted = math.copysign(min(free, self._max_speed), gap)
        velocity = self._advance(wanted)
        if velocity != wanted:
            return 'acceleration'
        return 'speed' if free > self._max_speed else ''

    def brake(self) -> None:
        """Brake for one period, as hard as the limits allow."""
        self._advance(0.0)

    def _advance(self, wanted: float) -> float:
        step = self._speed_step
        change = min(max(wanted - self.velocity, -step), step)
        # A speed one rounding error out of reach is reached: the joint comes truly to rest.
        within = abs(wanted - self.velocity - change) < 1e-9 * step
        self.velocity = wanted if within else self.velocity + change
        self.position += self.velocity * self._period_s
        return self.velocity
