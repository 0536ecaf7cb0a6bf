"""Find a joint that does not follow: it is far from its command, and has come no nearer."""

import numpy as np
from numpy.typing import NDArray

_PROGRESS_RAD = 0.02
"""A joint that has come this much nearer to its command moves; it is not stalled."""


class StallWatch:
    """Watches both joints while the head follows targets; all times are those of measurements.

    A joint without new measurements is stale, not stalled.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget the past: the head starts at rest, where it stands."""
        self._from: NDArray[np.float64] | None = None
        self._since_s = np.zeros(2)

    def is_stalled(
        self,
        command: NDArray[np.float64],
        measured: NDArray[np.float64],
        measured_s: float,
        error_rad: float,
        after_s: float,
    ) -> bool:
        """Return whether a joint is farther than `error_rad` off and came no nearer for `after_s`.

        `command` and `measured` (2,) [rad], of the time `measured_s` [s].
        """
        if self._from is None:
            self._from = measured.copy()
            self._since_s = np.full(2, measured_s)
        gap = command - measured
        progress = np.sign(gap) * (measured - self._from)
        moving = (np.abs(gap) <= error_rad) | (progress > _PROGRESS_RAD)
        self._from[moving] = measured[moving]
        self._since_s[moving] = measured_s
        return not np.all(measured_s - self._since_s <= after_s)
