"""Rays, directions and postures of a pan-tilt camera head (REP-103 and optical-frame axes).

A *posture* is ``(pan, tilt)`` in radians: pan turns about z (positive left), then tilt about y
(positive down). A *ray* is ``(x, y)`` in the camera's optical frame with z = 1 (x right, y down).
The *direction* of a thing is the posture at which it stands in the centre of the image. The
camera's optical centre is taken to lie on both axes.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def vectors_of_directions(directions: ArrayLike) -> NDArray[np.float64]:
    """Unit vectors, shape (..., 3), of directions, shape (..., 2) [rad], in the base frame."""
    pan, tilt = np.moveaxis(np.asarray(directions, float), -1, 0)
    return np.stack(
        [np.cos(tilt) * np.cos(pan), np.cos(tilt) * np.sin(pan), -np.sin(tilt)], axis=-1
    )


def directions_of_vectors(vectors: ArrayLike) -> NDArray[np.float64]:
    """Directions (pan, tilt) [rad], shape (..., 2), of base-frame vectors, shape (..., 3)."""
    x, y, z = np.moveaxis(np.asarray(vectors, float), -1, 0)
    return np.stack([np.arctan2(y, x), -np.arctan2(z, np.hypot(x, y))], axis=-1)


def head_rotation(posture: ArrayLike) -> NDArray[np.float64]:
    """Rotation matrix (3, 3) from the head frame (x forward, y left, z up) to the base frame."""
    pan, tilt = np.asarray(posture, float)
    cp, sp, ct, st = np.cos(pan), np.sin(pan), np.cos(tilt), np.sin(tilt)
    return np.array([[cp * ct, -sp, cp * st], [sp * ct, cp, sp * st], [-st, 0.0, ct]])


def directions_of_rays(posture: ArrayLike, rays: ArrayLike) -> NDArray[np.float64]:
    """Directions, shape (..., 2) [rad], of things seen at rays (..., 2) from a posture."""
    rays = np.asarray(rays, float)
    in_head = np.stack([np.ones(rays.shape[:-1]), -rays[..., 0], -rays[..., 1]], axis=-1)
    return directions_of_vectors(in_head @ head_rotation(posture).T)


def rays_of_directions(posture: ArrayLike, directions: ArrayLike) -> NDArray[np.float64]:
    """Rays, shape (..., 2), at which directions [rad] are seen from a posture; NaN if behind."""
    in_head = vectors_of_directions(directions) @ head_rotation(posture)
    forward = in_head[..., :1]
    with np.errstate(divide='ignore', invalid='ignore'):
        return np.where(forward > 1e-9, -in_head[..., 1:] / forward, np.nan)


def angle_between(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Angle [rad] between directions of shape (..., 2), along the great circle."""
    u, v = vectors_of_directions(a), vectors_of_directions(b)
    return np.arctan2(np.linalg.norm(np.cross(u, v), axis=-1), np.einsum('...i,...i->...', u, v))
