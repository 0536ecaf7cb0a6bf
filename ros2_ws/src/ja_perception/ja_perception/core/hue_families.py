"""Hues that belong together, by the valleys of their histogram on the hue circle."""

import numpy as np
from numpy.typing import NDArray

HUES = 180
"""OpenCV's hues, in steps of two degrees."""
# Hues within such an arc need no closer look.
_ONE_HUE = 20
# A hue is a peak of its own when it is this large beside the largest peak, and when the valleys
# beside it are lower than this share of it.
_LEAST_PEAK, _VALLEY = 0.1, 0.4
_BLUR = 4


def _blurring() -> NDArray[np.float32]:
    """Blurs a histogram round the circle of hues: (182, 180), for the ends meet in the result."""
    apart = (np.arange(HUES) - np.arange(-1, HUES + 1)[:, None]) % HUES
    weights = np.exp(-0.5 * (np.minimum(apart, HUES - apart) / _BLUR) ** 2)
    return (weights / weights[0].sum()).astype(np.float32)


_BLURRING = _blurring()


def hue_families(histogram: NDArray[np.float32]) -> NDArray[np.uint8] | None:
    """Family number of each hue, as a table for ``cv2.LUT``; None when all are of one family.

    ``histogram`` has the number of pixels of each hue, shape (180,). Shape (256,): what lies
    beyond the hues has no meaning.
    """
    used = np.flatnonzero(histogram)
    if not used.size:
        return None
    widest_gap = max(used[0] + HUES - used[-1], (used[1:] - used[:-1]).max(initial=0))
    if HUES - widest_gap < _ONE_HUE:
        return None
    ring = _BLURRING @ histogram
    smooth = ring[1:-1]
    is_peak = (smooth > ring[:-2]) & (smooth >= ring[2:])
    peaks = np.flatnonzero(is_peak & (smooth > _LEAST_PEAK * smooth.max())).tolist()
    twice_round = np.concatenate([smooth, smooth])
    while len(peaks) > 1:
        ends = [*peaks[1:], peaks[0] + HUES]
        cuts = [a + int(twice_round[a:b].argmin()) for a, b in zip(peaks, ends, strict=True)]
        valleys = twice_round[cuts]
        # Each peak against the higher of its two valleys: the shallowest one falls first.
        depths = np.maximum(valleys, np.roll(valleys, 1)) / smooth[peaks]
        shallowest = int(depths.argmax())
        if depths[shallowest] <= _VALLEY:
            borders = np.sort(np.array(cuts) % HUES)
            family = np.searchsorted(borders, np.arange(256), side='right') % len(peaks)
            return family.astype(np.uint8)
        del peaks[shallowest]
    return None
