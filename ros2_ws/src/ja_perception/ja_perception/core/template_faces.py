"""Template matching, as the face detector of Nagai, Hosoda and Asada (2003) works."""

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_perception.core.box import Box
from ja_perception.core.faces import Face, FaceFinder, cut_square, suppress_non_maxima

_CUT_PX = 128
# Widths of the face tried, as shares of the square's side.
_SCALES = 0.2 * 1.15 ** np.arange(9)
_TEMPLATE_PX = 32
# Confidence that the teacher needs.
_SURE = 0.8


class TemplateFaces:
    """Finds again the first face that another finder (the ``teacher``) has found.

    The template is that face, 32x32 in grey, matched at nine sizes by normalised correlation,
    which is the score. It finds one person, in the pose of the template.
    """

    smallest_share = float(_SCALES[0])

    def __init__(self, teacher: FaceFinder, least_score: float = 0.6) -> None:
        self._teacher = teacher
        self._least_score = least_score
        self._template: NDArray[np.uint8] | None = None

    def find_faces(self, image: NDArray[np.uint8], square: Box) -> list[Face]:
        """See ``FaceFinder.find_faces``."""
        if self._template is None:
            found = self._teacher.find_faces(image, square)
            # A false alarm as the template would be found for ever.
            found = [face for face in found if face.score >= _SURE]
            if found:
                self._template = _grey(image, _squared(found[0].box), _TEMPLATE_PX)
            return found
        cut = _grey(image, square, _CUT_PX)
        return suppress_non_maxima(
            [f for share in _SCALES for f in self._match(cut, share, square)]
        )

    def _match(self, cut: NDArray[np.uint8], share: float, square: Box) -> list[Face]:
        side = round(share * _CUT_PX)
        template = cv2.resize(self._template, (side, side), interpolation=cv2.INTER_AREA)
        match = cv2.matchTemplate(cut, template, cv2.TM_CCOEFF_NORMED)
        _, score, _, (x, y) = cv2.minMaxLoc(match)
        if score < self._least_score:
            return []
        scale = square.width / _CUT_PX
        u, v = square.left + scale * (x + side / 2), square.top + scale * (y + side / 2)
        return [Face(Box(u, v, scale * side, scale * side), float(score), np.empty((0, 2)))]


def _grey(image: NDArray[np.uint8], square: Box, side: int) -> NDArray[np.uint8]:
    return cv2.cvtColor(cut_square(image, square, side), cv2.COLOR_RGB2GRAY)


def _squared(box: Box) -> Box:
    side = max(box.width, box.height)
    return Box(box.u, box.v, side, side)
