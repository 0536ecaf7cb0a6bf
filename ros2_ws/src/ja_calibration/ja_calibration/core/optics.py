"""What views of a head at rest tell: the camera, the play and the signs that explain them best.

The camera turns about its optical centre, so that how far things are plays no part. With the
angle e that a joint says, the camera points at

    angle = sign * (e - e_0) - side * backlash / 2

since the play lies between encoder and camera, and the camera trails. A negative sign is a joint
that counts the other way than REP-103. The encoders' radian is taken at its word: a focal length
and a scale of the encoders both make things move faster in the picture, and small turns do not
tell them apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from ja_calibration.core.figure import Figure, jackknife
from ja_calibration.core.views import Points, View
from ja_common.core.geometry import directions_of_rays, head_rotation, vectors_of_directions

_FOLLOWS_PX_RAD = 10.0
"""A picture that moves by less for a radian does not follow the head."""

_GROUPS = 8


@dataclass(frozen=True)
class Optics:
    """What views of a head at rest tell: focal lengths [px], tilt's backlash [rad], signs.

    `signs`: (pan, tilt); -1 where a joint counts the other way than it was told to be counted.
    """

    focal_x: Figure
    focal_y: Figure
    tilt_backlash: Figure
    signs: tuple[float, float]


def fit_optics(reference: View, views: Sequence[View], sides: ArrayLike) -> Optics:
    """Explain where the reference's points are in the views.

    `sides` (views, 2): from which side each joint has come, +1 from below, as the reference has,
    or -1 from above. Errors are by groups of views: the encoders' is the same for all
    points of one. Raises ValueError when the picture does not follow the head.
    """
    points = Points(reference.grey)
    height, width = reference.grey.shape
    scene = _Scene(
        points.pixels.astype(float),
        np.array([points.find_in(view.grey) for view in views]),
        np.array([view.angles - reference.angles for view in views]),
        np.asarray(sides, float),
        np.array([(width - 1) / 2, (height - 1) / 2]),
    )
    guess = scene.first_guess()
    signs = np.sign(guess)
    start = np.array([*np.abs(guess), 0.0, 0.0, 0.0, 0.0])
    groups = [np.arange(begin, len(views), _GROUPS) for begin in range(_GROUPS)]
    found = jackknife(lambda chosen: scene.fit(chosen, start, signs), groups)
    # The pan's play is told better by its sways.
    focal_x, focal_y, _, tilt_play = found[:4]
    return Optics(focal_x, focal_y, tilt_play, (float(signs[0]), float(signs[1])))


@dataclass(frozen=True)
class _Scene:
    """All that was seen: N points of the reference in M views; pixels, angles [rad] and sides."""

    pixels: NDArray[np.float64]
    seen: NDArray[np.float64]
    angles: NDArray[np.float64]
    sides: NDArray[np.float64]
    centre: NDArray[np.float64]

    def first_guess(self) -> NDArray[np.float64]:
        """Signed focal lengths (2,) [px] from the median flow, as if nothing had play."""
        flow = np.nanmedian(self.seen - self.pixels, axis=1)
        # A turn to the left moves the picture to the right; one downward moves it up.
        turned = self.angles * [1.0, -1.0]
        guess = np.sum(turned * flow, axis=0) / np.sum(turned**2, axis=0)
        if not np.all(np.abs(guess) > _FOLLOWS_PX_RAD):
            raise ValueError(
                f'the picture moves by {guess[0]:.2f} and {guess[1]:.2f} px for a radian of pan '
                'and tilt: is it the camera on this head, and does the head move?'
            )
        return guess

    def fit(
        self, chosen: NDArray[np.int_], start: NDArray[np.float64], signs: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Focal lengths, backlash, and the reference's own error of posture, (6,).

        By the median over the points: things that move by themselves do not count.
        """

        def residuals(parameters: NDArray[np.float64]) -> NDArray[np.float64]:
            predicted = self._predicted(parameters, chosen, signs)
            return np.nanmedian(predicted - self.seen[chosen], axis=1).ravel()

        return least_squares(residuals, start, x_scale=[100.0, 100.0, *[0.01] * 4]).x

    def _predicted(
        self,
        parameters: NDArray[np.float64],
        chosen: NDArray[np.int_],
        signs: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Where the points are in the chosen views, (M, N, 2) [px]."""
        focal, play, offset = parameters[:2], parameters[2:4], parameters[4:]
        # In the rig's axes the play trails; in ours that is the other side where it is inverted.
        lag = signs * play / 2
        directions = directions_of_rays(-lag, (self.pixels - self.centre) / focal)
        postures = signs * self.angles[chosen] - self.sides[chosen] * lag + offset
        turns = np.array([head_rotation(posture) for posture in postures])
        in_head = vectors_of_directions(directions) @ turns
        return self.centre - focal * in_head[..., 1:] / in_head[..., :1]


def fit_gain(commanded: ArrayLike, measured: ArrayLike) -> Figure:
    """How far a joint goes for a radian of its command; both (N,) [rad], at rest."""
    told, done = np.asarray(commanded, float), np.asarray(measured, float)

    def fit(chosen: NDArray[np.int_]) -> NDArray[np.float64]:
        return np.polyfit(told[chosen], done[chosen], 1)[:1]

    return jackknife(fit, [np.array([index]) for index in range(len(told))])[0]
