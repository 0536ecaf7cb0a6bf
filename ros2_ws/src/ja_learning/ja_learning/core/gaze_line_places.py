"""The places of seen objects, as the fast learner weighs and remembers them: rows of a table.

A row has 8 columns: the direction from her face in the robot's view (pan, tilt), and, where the
distances are known, the six of `directions_from_eyes`, else NaN. Angles are in units of
`ANGLE_SCALE_RAD`.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_learning.core.directions_from_eyes import COLUMNS, directions_from_eyes
from ja_learning.core.trial import Look

ANGLE_SCALE_RAD = float(np.radians(40))
PLACE_COLUMNS = 2 + COLUMNS
IN_VIEW, FROM_EYES, HER_DISTANCE, COVARIANCE = slice(0, 2), slice(2, 4), 4, slice(5, 8)
"""The columns: see above."""

_SCALES = np.array([ANGLE_SCALE_RAD] * 4 + [1.0] + [ANGLE_SCALE_RAD**2] * 3)


def seen_places(
    look: Look, candidates: ArrayLike, ranges: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Return the rows (m, 8) of candidates (m, 2) [rad] with these ranges (m, 2) [m]."""
    directions = np.asarray(candidates, float).reshape(-1, 2)
    from_eyes = directions_from_eyes(directions, ranges, look.face_at, look.face_range)
    return np.concatenate([directions - look.face_at, from_eyes], axis=1) / _SCALES


def known_from_eyes(places: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return of which rows (..., 8) the direction from her eyes is known."""
    return ~np.isnan(places[..., HER_DISTANCE])
