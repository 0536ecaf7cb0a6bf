"""Where on the line of a gaze is the gaze target? A mixture over stretches of it, as arithmetic.

    p(c | face) = sum_k w_k N(c; o + r_k u, r_k^2 (s_r^2 u u^T + s_u^2 I) + s_c^2 I),  u = u(face)

Where the distance of a thing is known, the sum over stretches is replaced by one term: u is the
direction from her eyes (`LineMixture.log_from_eyes`).

Torch learns it, numpy evaluates it: torch releases the interpreter in each of its operations, and
an answer that is due soon would then wait for the thread that learns.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray

Array = TypeVar('Array', torch.Tensor, NDArray[np.float64])

FIRST_STRETCH, LAST_STRETCH, STRETCH_COUNT = 0.35, 2.2, 9
"""The stretches r_k of all members, in equal steps of their logarithm."""


@dataclass(frozen=True)
class LineMixture(Generic[Array]):
    """All the numbers of p(c | face) but the gaze; shapes broadcast to (members, n, stretches).

    `stretches`: r_k; `log_shares`: log w_k; `origin_tilt`: of o; `of_stretch`, `of_gaze`,
    `of_place`: the variances s_r^2, s_u^2, s_c^2. Members have the first axis.
    """

    stretches: Array
    log_shares: Array
    origin_tilt: Array
    of_stretch: Array
    of_gaze: Array
    of_place: Array

    def as_numpy(self: 'LineMixture[torch.Tensor]') -> 'LineMixture[NDArray[np.float64]]':
        """Copy the numbers as arrays."""
        arrays = {name: each.detach().numpy().astype(float) for name, each in vars(self).items()}
        return LineMixture(**arrays)

    def joined(
        self: 'LineMixture[NDArray[np.float64]]', other: 'LineMixture[NDArray[np.float64]]'
    ) -> 'LineMixture[NDArray[np.float64]]':
        """Return the members of both, whose stretches must be the same."""
        both = (self, other)
        counts = [len(each.log_shares) for each in both]

        def members(name: str) -> NDArray[np.float64]:
            parts = [getattr(each, name) for each in both]
            shapes = [(n, 1, part.shape[-1]) for n, part in zip(counts, parts, strict=True)]
            return np.concatenate(
                [np.broadcast_to(*pair) for pair in zip(parts, shapes, strict=True)]
            )

        return LineMixture(
            self.stretches,
            *map(members, ('log_shares', 'origin_tilt', 'of_stretch', 'of_gaze', 'of_place')),
        )

    def on_line(self, pan: Array, tilt: Array) -> tuple[Array, Array]:
        """Return o + r_k u for gazes (members, n, 1): (members, n, stretches), pan and tilt."""
        return self.stretches * pan, self.origin_tilt + self.stretches * tilt

    def forms(self, pan: Array, tilt: Array, log: Callable[[Array], Array]) -> list[Array]:
        """Return factors of `powers(c)` in log w_k N(c; ...): six arrays (members, n, stretches).

        For gazes (members, n, 1); `log`: of the library that the arrays are of. To weigh many
        places, the largest work of an update, is then one product of matrices.
        """
        squared = self.stretches**2
        across, further = squared * self.of_gaze + self.of_place, squared * self.of_stretch
        along = across + further * (pan**2 + tilt**2)
        # Of the covariance `across` I + `further` u u^T the inverse, by Sherman and Morrison.
        less = further / along
        pans = (1 - less * pan**2) / across
        tilts = (1 - less * tilt**2) / across
        both = -less * pan * tilt / across
        at_pan, at_tilt = self.on_line(pan, tilt)
        to_pan, to_tilt = pans * at_pan + both * at_tilt, both * at_pan + tilts * at_tilt
        peak = self.log_shares - 0.5 * log(across * along) - math.log(2 * math.pi)
        at_zero = peak - 0.5 * (at_pan * to_pan + at_tilt * to_tilt)
        return [at_zero, to_pan, to_tilt, -0.5 * pans, -both, -0.5 * tilts]

    def log_from_eyes(
        self,
        gaze: tuple[Array, Array],
        direction: Iterable[Array],
        her_distance: Array,
        covariance: Iterable[Array],
        log: Callable[[Array], Array],
        exp: Callable[[Array], Array],
    ) -> Array:
        """Return log p, (members, n, m), of things whose direction from her eyes is known.

        The same u, now as a direction from her eyes: N(d; u + (0, o h), S + (s_u^2 + s_c^2 h^2)
        I), with the direction d, her distance h and the covariance S as in `directions_from_eyes`.
        The factor sum_k w_k / r_k^2 makes it comparable with places in the view: as a likelihood
        of u both then have the same integral.
        """
        (pan, tilt), (at_pan, at_tilt), (var_pan, both, var_tilt) = gaze, direction, covariance
        spread = self.of_gaze + self.of_place * her_distance**2
        var_pan, var_tilt = var_pan + spread, var_tilt + spread
        off_pan, off_tilt = at_pan - pan, at_tilt - self.origin_tilt * her_distance - tilt
        determinant = var_pan * var_tilt - both**2
        squares = var_tilt * off_pan**2 - 2 * both * off_pan * off_tilt + var_pan * off_tilt**2
        factor = log((exp(self.log_shares) / self.stretches**2).sum(-1))[..., None]
        return factor - 0.5 * (squares / determinant + log(determinant)) - math.log(2 * math.pi)


def powers(pan: Array, tilt: Array) -> list[Array]:
    """Return the powers of a place that the quadratic forms multiply."""
    return [pan**0, pan, tilt, pan**2, pan * tilt, tilt**2]
