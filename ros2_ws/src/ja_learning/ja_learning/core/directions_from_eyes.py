"""In which direction from her eyes does a thing stand? The geometry of depth.

From the robot a line of gaze is a line: the direction of a thing does not show how far it is. With
the distances of a thing and of her face both are points in space, and her gaze is one direction,
wherever she and the things are.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.geometry import vectors_of_directions

MOST_UNCERTAIN = 0.2
"""A distance that is known to no more than this share of it counts as unknown."""

_LEAST_DEVIATION = 0.002
# A thing nearer to her eyes than this is in no direction from them [m].
_NEAREST_M = 0.05
COLUMNS = 6


def directions_from_eyes(
    directions: ArrayLike, ranges: ArrayLike | None, face_at: ArrayLike, face_range: ArrayLike
) -> NDArray[np.float64]:
    """Return directions from her eyes, and how well they are known, (m, 6).

    `directions` (m, 2) [rad] and `ranges` (m, 2) [m]: of things, from the robot, with the standard
    deviations of the ranges; `face_at` (2,) and `face_range` (2,): of her face.

    Columns 0, 1 [rad]: direction from her eyes, zero towards the camera, with the signs of the
    robot's head (positive to the robot's left, and down). Column 2: her distance from the camera
    in distances of the thing from her eyes. Columns 3 to 5 [rad^2]: the covariance of the
    direction (pan, both, tilt) that the uncertain distances cause. NaN where a distance is
    unknown, or too uncertain for a linear propagation of its error.
    """
    directions = np.asarray(directions, float).reshape(-1, 2)
    found = np.full((len(directions), COLUMNS), np.nan)
    if ranges is None:
        return found
    ranges, face_range = np.asarray(ranges, float).reshape(-1, 2), np.asarray(face_range, float)
    known = _known(ranges) & bool(_known(face_range[None])[0])
    if not known.any():
        return found
    rays = vectors_of_directions(directions[known])
    to_face = vectors_of_directions(face_at)
    distance, deviation = ranges[known].T
    deviation = np.maximum(deviation, _LEAST_DEVIATION * distance)
    face_distance, face_deviation = face_range
    face_deviation = max(face_deviation, _LEAST_DEVIATION * face_distance)

    def seen_from_eyes(
        distance: NDArray[np.float64], face_distance: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        vectors = distance[:, None] * rays - face_distance * to_face
        return _in_her_frame(vectors, face_at), np.linalg.norm(vectors, axis=1)

    here, away = seen_from_eyes(distance, face_distance)
    by_thing = seen_from_eyes(distance + deviation, face_distance)[0] - here
    by_face = seen_from_eyes(distance, face_distance + face_deviation)[0] - here
    pan, tilt = by_thing.T
    face_pan, face_tilt = by_face.T
    table = np.column_stack(
        [
            here,
            face_distance / np.maximum(away, _NEAREST_M),
            pan**2 + face_pan**2,
            pan * tilt + face_pan * face_tilt,
            tilt**2 + face_tilt**2,
        ]
    )
    table[away < _NEAREST_M] = np.nan
    found[known] = table
    return found


def _known(ranges: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which of ranges (m, 2) are known well enough; false for NaN."""
    return (ranges[:, 0] > 0) & (ranges[:, 1] <= MOST_UNCERTAIN * ranges[:, 0])


def _in_her_frame(vectors: NDArray[np.float64], face_at: ArrayLike) -> NDArray[np.float64]:
    """Return the directions (m, 2) [rad] of base-frame vectors (m, 3) from her eyes."""
    to_face = vectors_of_directions(face_at)
    pan = float(np.asarray(face_at, float)[0])
    left = np.array([-np.sin(pan), np.cos(pan), 0.0])
    up = np.cross(to_face, left)
    towards, aside, above = -vectors @ to_face, vectors @ left, vectors @ up
    return np.column_stack(
        [np.arctan2(aside, towards), -np.arctan2(above, np.hypot(towards, aside))]
    )
