"""Eq. 3 of Nagai, Hosoda and Asada (2003): whether a thing is in the image centre.

The paper measures the distance from the image centre in pixels; here it is measured on the image
plane at unit focal length (rays), so that one threshold serves every camera. The paper's threshold
of a sixth of the image's width is ``WIDTH_SIXTH`` for its view of +-18 degrees.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

WIDTH_SIXTH = math.atan(2 * math.tan(math.radians(18)) / 6)
"""d_th [rad] that equals (image width)/6 for a horizontal view of +-18 degrees: 6.18 degrees."""


def stands_in_centre(ray: ArrayLike, d_th_rad: float) -> bool:
    """Return whether the ray (x, y) is less than d_th [rad] from the optical axis (Eq. 3)."""
    return bool(np.hypot(*np.asarray(ray, float)) < math.tan(d_th_rad))


def nearest_to_centre(rays: ArrayLike, d_th_rad: float) -> int | None:
    """Return the index of the ray in (n, 2) nearest to the centre; None if none is within d_th."""
    rays = np.asarray(rays, float).reshape(-1, 2)
    if not len(rays):
        return None
    distances = np.hypot(rays[:, 0], rays[:, 1])
    nearest = int(np.argmin(distances))
    return nearest if distances[nearest] < math.tan(d_th_rad) else None
