"""Fit focal lengths, backlash and signs of the joints to images of a head at rest.

The camera turns about its optical centre, so distances do not matter. At the encoder's angle e the
camera points at

    angle = sign * (e - e_0) - side * backlash / 2

because the backlash lies between encoder and camera, and the camera trails. A joint with a
negative sign counts the other way than REP-103. The scale of the encoders is assumed to be right:
a longer focal length and a larger encoder scale both make points move faster in the image, and
small turns do not separate them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from ja_calibration.core.fitted_value import FittedValue, jackknife
from ja_calibration.core.posed_image import PosedImage, TrackedPoints
from ja_common.core.geometry import directions_of_rays, head_rotation, vectors_of_directions

_FOLLOWS_PX_RAD = 10.0
"""An image that moves by less for a radian does not follow the head."""

_GROUPS = 8


@dataclass(frozen=True)
class Optics:
    """Focal lengths [px], backlash of the tilt joint [rad] and signs of the joints.

    `signs`: (pan, tilt); -1 where a joint counts the other way than its parameters state.
    """

    focal_x: FittedValue
    focal_y: FittedValue
    tilt_backlash: FittedValue
    signs: tuple[float, float]


def fit_optics(reference: PosedImage, images: Sequence[PosedImage], sides: ArrayLike) -> Optics:
    """Fit the optics to where the points of the reference lie in the images, by least squares.

    `sides` (images, 2): the side from which each joint came, +1 from below, as in the reference,
    or -1 from above. The jackknife leaves out groups of images, because the error of the encoders
    is the same for all points of one image. Raises ValueError when the images do not follow the
    head.
    """
    points = TrackedPoints(reference.grey)
    height, width = reference.grey.shape
    scene = _Scene(
        points.pixels.astype(float),
        np.array([points.find_in(image.grey) for image in images]),
        np.array([image.angles - reference.angles for image in images]),
        np.asarray(sides, float),
        np.array([(width - 1) / 2, (height - 1) / 2]),
    )
    guess = scene.first_guess()
    signs = np.sign(guess)
    start = np.array([*np.abs(guess), 0.0, 0.0, 0.0, 0.0])
    groups = [np.arange(begin, len(images), _GROUPS) for begin in range(_GROUPS)]
    fitted = jackknife(lambda chosen: scene.fit(chosen, start, signs), groups)
    # The sweeps measure the backlash of the pan joint better.
    focal_x, focal_y, _, tilt_backlash = fitted[:4]
    return Optics(focal_x, focal_y, tilt_backlash, (float(signs[0]), float(signs[1])))


@dataclass(frozen=True)
class _Scene:
    """N points of the reference, where they are in M images, and the images' angles and sides.

    `pixels` (N, 2), `found` (M, N, 2) and `centre` (2,) [px]; `angles` (M, 2) [rad]; `sides`
    (M, 2).
    """

    pixels: NDArray[np.float64]
    found: NDArray[np.float64]
    angles: NDArray[np.float64]
    sides: NDArray[np.float64]
    centre: NDArray[np.float64]

    def first_guess(self) -> NDArray[np.float64]:
        """Estimate signed focal lengths (2,) [px] from the median flow, without backlash."""
        flow = np.nanmedian(self.found - self.pixels, axis=1)
        # A turn to the left moves the image to the right; a turn down moves it up.
        turned = self.angles * [1.0, -1.0]
        guess = np.sum(turned * flow, axis=0) / np.sum(turned**2, axis=0)
        if not np.all(np.abs(guess) > _FOLLOWS_PX_RAD):
            raise ValueError(
                f'the image moves by {guess[0]:.2f} and {guess[1]:.2f} px for a radian of pan '
                'and tilt: is it the camera on this head, and does the head move?'
            )
        return guess

    def fit(
        self, chosen: NDArray[np.int_], start: NDArray[np.float64], signs: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Fit focal lengths, backlash and the posture error of the reference, (6,).

        The median over the points makes moving objects harmless.
        """

        def residuals(parameters: NDArray[np.float64]) -> NDArray[np.float64]:
            predicted = self._predicted(parameters, chosen, signs)
            return np.nanmedian(predicted - self.found[chosen], axis=1).ravel()

        return least_squares(residuals, start, x_scale=[100.0, 100.0, *[0.01] * 4]).x

    def _predicted(
        self,
        parameters: NDArray[np.float64],
        chosen: NDArray[np.int_],
        signs: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Where the points are in the chosen images, (M, N, 2) [px]."""
        focal, backlash, offset = parameters[:2], parameters[2:4], parameters[4:]
        # The camera trails in the axes of the rig: on the other side in ours where a joint is
        # inverted.
        lag = signs * backlash / 2
        directions = directions_of_rays(-lag, (self.pixels - self.centre) / focal)
        postures = signs * self.angles[chosen] - self.sides[chosen] * lag + offset
        turns = np.array([head_rotation(posture) for posture in postures])
        in_head = vectors_of_directions(directions) @ turns
        return self.centre - focal * in_head[..., 1:] / in_head[..., :1]


def fit_gain(commanded: ArrayLike, measured: ArrayLike) -> FittedValue:
    """Fit how far a joint turns for one radian of its command; both (N,) [rad], at rest."""
    commanded, measured = np.asarray(commanded, float), np.asarray(measured, float)

    def fit(chosen: NDArray[np.int_]) -> NDArray[np.float64]:
        return np.polyfit(commanded[chosen], measured[chosen], 1)[:1]

    return jackknife(fit, [np.array([index]) for index in range(len(commanded))])[0]
