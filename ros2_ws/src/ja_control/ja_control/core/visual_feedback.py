"""Eq. 2 of Nagai, Hosoda and Asada (2003): the visual feedback controller."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import Configuration, parameter


@dataclass(frozen=True)
class VisualFeedbackConfig(Configuration):
    """The one number of Eq. 2."""

    gain: float = parameter(
        1.0, 'g of Eq. 2 [rad per unit of ray]; 1 turns the head to the target', low=0.0, high=2.0
    )


def visual_feedback(ray: ArrayLike, gain: float) -> NDArray[np.float64]:
    """Return the change of posture (pan, tilt), (2,) [rad], that centres a ray (x, y).

    Eq. 2: (dpan, dtilt) = g (x_i - c_x, y_i - c_y), with the distance from the centre in units of
    the focal length and the axes of REP-103: an object right of the centre needs negative pan,
    one below it positive tilt.
    """
    x, y = np.asarray(ray, float)
    return gain * np.array([-x, y])
