"""The internal evaluator (Nagai et al. 2003, section 2.2.3): has visual attention succeeded?

It knows whether *an* object stands in the centre, never whether it is the attended object.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import Configuration, parameter
from ja_common.core.detection import Detection, Kind, objects
from ja_common.core.fixation import WIDTH_SIXTH, nearest_to_centre
from ja_common.core.geometry import directions_of_rays
from ja_common.core.posture import STILL_BELOW_RAD_S, Posture
from ja_common.core.stamps import NS_PER_S
from ja_learning.core.trial import same_posture


@dataclass(frozen=True)
class EvaluatorConfig(Configuration):
    """Configuration of the internal evaluator: when an object counts as fixated."""

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
    hold_s: float = parameter(
        0.0,
        'how long the head must have stood still: what is seen for less is a glance, no fixation',
        low=0.0, high=10.0,
    )  # fmt: skip
    still_below_rad_s: float = parameter(
        STILL_BELOW_RAD_S, 'a joint slower than this stands still', low=1e-4, high=5.0
    )


class InternalEvaluator:
    """Eq. 3 on one image after the other, while the head stands still."""

    def __init__(self, config: EvaluatorConfig) -> None:
        """Start with a head that has not stood still yet; `config` may be replaced at any time."""
        self.config = config
        self._rests: Posture | None = None

    def find_fixation(
        self, detections: list[Detection], posture: Posture
    ) -> NDArray[np.float64] | None:
        """Return the direction (pan, tilt), shape (2,) [rad], of the fixated object, or None.

        None until the head has stood still for long enough, and while a face stands nearer to the
        centre than the object: then the head watches a person, not an object.
        """
        if not self._holds_still(posture):
            return None
        seen = objects(detections)
        if self.config.candidate == 'most_salient':
            seen = sorted(seen, key=lambda d: d.score)[-1:]
        nearest = nearest_to_centre([d.ray for d in seen], self.config.d_th_rad)
        if nearest is None:
            return None
        distance = np.hypot(*seen[nearest].ray)
        faces = [d for d in detections if d.kind is Kind.FACE]
        if not all(np.hypot(*face.ray) >= distance for face in faces):
            return None
        return directions_of_rays(posture.position, seen[nearest].ray)

    def _holds_still(self, posture: Posture) -> bool:
        if not posture.is_still(self.config.still_below_rad_s):
            self._rests = None
            return False
        rests = self._rests
        held_s = 0.0 if rests is None else (posture.stamp_ns - rests.stamp_ns) / NS_PER_S
        # Between two images the head may have turned from one rest to another.
        if rests is None or held_s < 0 or not same_posture(rests.position, posture.position):
            self._rests, held_s = posture, 0.0
        return held_s >= self.config.hold_s
