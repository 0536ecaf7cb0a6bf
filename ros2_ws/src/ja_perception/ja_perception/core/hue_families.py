"""Hues that belong together, by the valleys of their histogram on the hue circle."""

import cv2
import numpy as np
from numpy.typing import NDArray

HUES = 180
"""OpenCV's hues, in steps of two degrees."""
_BLUR = 4
# Hues within such an arc need no closer look.
_ONE_HUE = 20
# A hue is a peak of its own when it is this large beside the largest peak, and when the valleys
# beside it are lower than this share of it.
_LEAST_PEAK, _VALLEY = 0.1, 0.4


def hue_families(histogram: NDArray[np.float32]) -> NDArray[np.intp] | None:
    """Family number of each of the 180 hues, shape (180,); None when all are of one family."""
    used = np.flatnonzero(histogram)
    unused = np.diff(used, append=used[:1] + HUES)
    if HUES - unused.max(initial=0) < _ONE_HUE:
        return None
    ring = np.tile(histogram, 3)[None]
    smooth = cv2.GaussianBlur(ring, (0, 0), _BLUR)[0, HUES : 2 * HUES]
    is_peak = (smooth > np.roll(smooth, 1)) & (smooth >= np.roll(smooth, -1))
    peaks = np.flatnonzero(is_peak & (smooth > _LEAST_PEAK * smooth.max())).tolist()
    while len(peaks) > 1:
        nexts = peaks[1:] + peaks[:1]
        cuts = [_lowest_between(smooth, *pair) for pair in zip(peaks, nexts, strict=True)]
        # Each peak against the higher of its two valleys: the shallowest one falls first.
        depths = [
            max(smooth[cuts[i - 1]], smooth[cuts[i]]) / smooth[peak]
            for i, peak in enumerate(peaks)
        ]
        shallowest = int(np.argmax(depths))
        if depths[shallowest] <= _VALLEY:
            return np.searchsorted(np.sort(cuts), np.arange(HUES), side='right') % len(peaks)
        del peaks[shallowest]
    return None


def _lowest_between(smooth: NDArray[np.float32], start: int, end: int) -> int:
    """The hue of the lowest value on the way from ``start`` up the circle to ``end``."""
    way = (start + np.arange((end - start) % HUES or HUES)) % HUES
    return int(way[np.argmin(smooth[way])])
