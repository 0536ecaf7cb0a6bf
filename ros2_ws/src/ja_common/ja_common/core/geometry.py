"""Rays, directions and postures of a pan-tilt camera head (REP-103 and optical-frame axes).

A *posture* is ``(pan, tilt)`` in radians: pan turns about z (positive left), then tilt about y
(positive down). A *ray* is ``(x, y)`` in the camera's optical frame with z = 1 (x right, y down).
The *direction* of a thing is the posture at which it stands in the centre of the image. The
camera's optical centre is taken to lie on both axes.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray


def finite_pair(what: str, values: ArrayLike) -> NDArray[np.float64]:
    """Return a copy (2,) of two finite numbers (pan, tilt); raise ValueError for anything else.

    `what`: what the values are, for the message.
    """
    pair = np.array(values, float)
    if pair.shape != (2,) or not np.isfinite(pair).all():
        raise ValueError(f'{what} must be two finite numbers (pan, tilt), got {pair.tolist()}')
    return pair


def vectors_of_directions(directions: ArrayLike) -> NDArray[np.float64]:
    """Return the unit vectors (..., 3) of directions (..., 2) [rad], in the base frame."""
    directions = np.asarray(directions, float)
    pan, tilt = directions[..., 0], directions[..., 1]
    forward = np.cos(tilt)
    return _as_last_axis(forward * np.cos(pan), forward * np.sin(pan), -np.sin(tilt))


def directions_of_vectors(vectors: ArrayLike) -> NDArray[np.float64]:
    """Return the directions (..., 2) (pan, tilt) [rad] of base-frame vectors (..., 3)."""
    vectors = np.asarray(vectors, float)
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return _as_last_axis(np.arctan2(y, x), -np.arctan2(z, np.hypot(x, y)))


def head_rotation(posture: ArrayLike) -> NDArray[np.float64]:
    """Return the rotation (3, 3) from head frame (x forward, y left, z up) to base frame."""
    pan, tilt = map(float, np.asarray(posture))
    cp, sp, ct, st = math.cos(pan), math.sin(pan), math.cos(tilt), math.sin(tilt)
    return np.array([[cp * ct, -sp, cp * st], [sp * ct, cp, sp * st], [-st, 0.0, ct]])


def vectors_of_rays(posture: ArrayLike, rays: ArrayLike) -> NDArray[np.float64]:
    """Return base-frame vectors (..., 3) of rays (..., 2) from a posture: one unit deep."""
    rays = np.asarray(rays, float)
    in_head = _as_last_axis(np.ones(rays.shape[:-1]), -rays[..., 0], -rays[..., 1])
    return in_head @ head_rotation(posture).T


def directions_of_rays(posture: ArrayLike, rays: ArrayLike) -> NDArray[np.float64]:
    """Return the directions, shape (..., 2) [rad], of what is seen at rays (..., 2)."""
    return directions_of_vectors(vectors_of_rays(posture, rays))


def rays_of_directions(posture: ArrayLike, directions: ArrayLike) -> NDArray[np.float64]:
    """Return the rays, shape (..., 2), at which directions [rad] are seen; NaN if behind."""
    in_head = vectors_of_directions(directions) @ head_rotation(posture)
    forward = in_head[..., :1]
    with np.errstate(divide='ignore', invalid='ignore'):
        return np.where(forward > 1e-9, -in_head[..., 1:] / forward, np.nan)


def angle_between(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Return the angle [rad] between directions (..., 2), along the great circle (haversine)."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    squares = np.sin((a - b) / 2) ** 2
    share = squares[..., 1] + np.cos(a[..., 1]) * np.cos(b[..., 1]) * squares[..., 0]
    return 2 * np.arcsin(np.sqrt(np.minimum(share, 1.0)))


def _as_last_axis(*components: ArrayLike) -> NDArray[np.float64]:
    # What np.stack does, at a third of its time: these arrays are small and many.
    stacked = np.empty((*np.shape(components[0]), len(components)))
    for index, component in enumerate(components):
        stacked[..., index] = component
    return stacked
