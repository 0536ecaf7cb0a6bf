"""The outcomes of trials."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

NOTHING = -1
"""Index of the fixated object in a trial without a fixation."""


@dataclass(frozen=True)
class Outcomes:
    """One entry a trial, in order.

    `fixated`: int8, index of the object fixated at the end (0: the attended one). `in_view`: was
    the attended object in view of the look at the caregiver? `pan_rad`: float32, pan [rad] from
    the look to the fixated object, NaN without a fixation. `shifts`: int8, number of shifts.
    """

    fixated: NDArray[np.int8]
    in_view: NDArray[np.bool_]
    pan_rad: NDArray[np.float32]
    shifts: NDArray[np.int8]

    @classmethod
    def blank(cls, trials: int) -> Outcomes:
        """Return empty outcomes of so many trials."""
        return cls(
            np.full(trials, NOTHING, np.int8),
            np.zeros(trials, bool),
            np.full(trials, np.nan, np.float32),
            np.zeros(trials, np.int8),
        )

    def __len__(self) -> int:
        return len(self.fixated)

    def __getitem__(self, chosen: slice) -> Outcomes:
        return Outcomes(
            self.fixated[chosen], self.in_view[chosen], self.pan_rad[chosen], self.shifts[chosen]
        )

    @property
    def success(self) -> NDArray[np.bool_]:
        """Return where joint attention succeeded: the attended object was fixated."""
        return self.fixated == 0
