"""Whether an eye is open: what shows between its lids has another colour than the skin around."""

import cv2
import numpy as np
from numpy.typing import NDArray

CORNERS, LOWER, UPPER = [0, 8], list(range(1, 8)), list(range(9, 16))
"""Rows of the lids (16, 2): outer and inner corner, lower lid, upper lid."""
# Around the eye: the lower lid from corner to corner, and back along the upper lid.
_AROUND = [*range(9), *range(15, 8, -1)]
# Height between the lids over the width of the eye.
_LEAST_OPENING = 0.1
# Skin is red, the white of an eye is not: how far its share of red less its share of blue falls
# below that of the skin under the eye. On the simulated people's closed lids at most 0.02, on
# their open eyes 0.06 and more at 320x240.
_LEAST_LOSS_OF_RED = 0.03
# The range of brightness (5 % to 95 %) over its mean, for irises as red as skin and for pictures
# without colour: 0.78 and less on closed lids, 1.3 on most open eyes.
_LEAST_CONTRAST = 0.8
# The rim, with its lashes, is dark on a closed eye, too.
_WITHIN = 0.8
# Larger eyes are blurred to the sharpness of one 13 px wide: contrast then means the same.
_BLUR_PX = 1.5
_LEAST_PIXELS = 10
_SUBPIXEL_BITS = 3


def is_open(lids: NDArray[np.float64], cut: NDArray[np.uint8]) -> bool:
    """Return whether the eye with ``lids`` (16, 2) [px] in an RGB picture (H, W, 3) is open."""
    width = np.linalg.norm(np.diff(lids[CORNERS], axis=0))
    opening = np.linalg.norm(lids[UPPER].mean(axis=0) - lids[LOWER].mean(axis=0))
    if opening < _LEAST_OPENING * width:
        return False
    picture = cv2.GaussianBlur(cut, (0, 0), _BLUR_PX).astype(float)
    between = _inside(lids, _WITHIN, cut)
    under = _inside(lids, 2.0, cut) & ~_inside(lids, 1.35, cut)
    under[: round(lids[:, 1].mean())] = False
    if min(between.sum(), under.sum()) < _LEAST_PIXELS:
        return False
    redness = (picture[..., 0] - picture[..., 2]) / (picture.sum(axis=-1) + 1.0)
    loss = redness[under].mean() - np.percentile(redness[between], 10)
    if loss >= _LEAST_LOSS_OF_RED:
        return True
    grey = picture.mean(axis=-1)[between]
    low, high = np.percentile(grey, (5, 95))
    return bool(high - low >= _LEAST_CONTRAST * grey.mean())


def _inside(lids: NDArray[np.float64], scale: float, cut: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return which pixels (H, W) lie within the lids, scaled about their middle."""
    middle = lids.mean(axis=0)
    corners = middle + scale * (lids[_AROUND] - middle)
    mask = np.zeros(cut.shape[:2], np.uint8)
    fixed_point = np.round(corners * 2**_SUBPIXEL_BITS).astype(np.int32)
    cv2.fillPoly(mask, [fixed_point], 1, shift=_SUBPIXEL_BITS)
    return mask > 0
