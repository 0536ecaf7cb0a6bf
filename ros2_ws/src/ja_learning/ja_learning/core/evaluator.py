"""The internal evaluator (Nagai et al. 2003, section 2.2.3): has visual attention succeeded?

It knows whether *an* object stands in the centre, never whether it is the one that was meant.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import parameter
from ja_common.core.detection import Detection, Kind, objects
from ja_common.core.fixation import WIDTH_SIXTH, nearest_to_centre
from ja_common.core.geometry import directions_of_rays
from ja_common.core.posture import STILL_BELOW_RAD_S, Posture


@dataclass(frozen=True)
class EvaluatorConfig:
    """When an object counts as fixated."""

    d_th_rad: float = parameter(
        WIDTH_SIXTH,
        'd_th of Eq. 3: how near to the centre an object must stand (image width / 6)',
        low=0.001, high=1.0,
    )  # fmt: skip
    candidate: str = parameter(
        'nearest',
        'which object is asked: the nearest to the centre, or the most salient of the view',
        choices=('nearest', 'most_salient'),
    )
    still_below_rad_s: float = parameter(
        STILL_BELOW_RAD_S, 'a joint slower than this stands still', low=1e-4, high=5.0
    )


class InternalEvaluator:
    """Eq. 3 on what one image shows, while the head stands still."""

    def __init__(self, config: EvaluatorConfig) -> None:
        self.config = config

    def fixation(
        self, detections: list[Detection], posture: Posture
    ) -> NDArray[np.float64] | None:
        """Direction (pan, tilt), shape (2,) [rad], of the fixated object, or None.

        None while the head moves, and while a face stands nearer to the centre than the object:
        then the head watches somebody, not something.
        """
        if not posture.is_still(self.config.still_below_rad_s):
            return None
        seen = objects(detections)
        if self.config.candidate == 'most_salient':
            seen = sorted(seen, key=lambda d: d.score)[-1:]
        nearest = nearest_to_centre([d.ray for d in seen], self.config.d_th_rad)
        if nearest is None:
            return None
        distance = np.hypot(*seen[nearest].ray)
        if any(np.hypot(*d.ray) < distance for d in detections if d.kind is Kind.FACE):
            return None
        return directions_of_rays(posture.position, seen[nearest].ray)
