"""Hues that belong together, by the valleys of their histogram on the hue circle."""

import numpy as np
from numpy.typing import NDArray

HUES = 180
"""OpenCV's hues, in steps of two degrees."""
ONE_HUE = 20
"""Hues within such an arc are of one family, whatever their histogram."""
# A hue is a peak of its own when it is this large beside the largest peak, and when the valleys
# beside it are lower than this share of it.
_LEAST_PEAK, _VALLEY = 0.1, 0.4
# Width of the bell that blurs the histogram, and how far it reaches.
_BLUR, _REACH = 4, 32


def _bell() -> NDArray[np.float32]:
    """Return the weights of the hues around one, shape (2 * 32 + 1,)."""
    weights = np.exp(-0.5 * (np.arange(-_REACH, _REACH + 1) / _BLUR) ** 2)
    return (weights / weights.sum()).astype(np.float32)


_BELL = _bell()


def hue_families(histogram: NDArray[np.float32]) -> NDArray[np.uint8] | None:
    """Return the family number of each hue, for ``cv2.LUT``; None when all are of one family.

    ``histogram``: number of pixels of each hue, shape (180,). The table has shape (256,); its
    values beyond the hues have no meaning.
    """
    used = np.flatnonzero(histogram)
    if not used.size:
        return None
    widest_gap = max(used[0] + HUES - used[-1], (used[1:] - used[:-1]).max(initial=0))
    if HUES - widest_gap < ONE_HUE:
        return None
    # The circle of hues, extended at both ends by values of the other end.
    beyond = _REACH + 1
    round_trip = np.concatenate([histogram[-beyond:], histogram, histogram[:beyond]])
    ring = np.convolve(round_trip, _BELL, 'valid')
    smooth = ring[1:-1]
    is_peak = (smooth > ring[:-2]) & (smooth >= ring[2:])
    peaks = np.flatnonzero(is_peak & (smooth > _LEAST_PEAK * smooth.max())).tolist()
    twice_round = np.concatenate([smooth, smooth])
    while len(peaks) > 1:
        nexts = [*peaks[1:], peaks[0] + HUES]
        cuts = [a + int(twice_round[a:b].argmin()) for a, b in zip(peaks, nexts, strict=True)]
        valleys = twice_round[cuts].tolist()
        heights = smooth[peaks].tolist()
        # Each peak against the higher of its two valleys: the shallowest peak is removed first.
        depths = [max(valleys[i - 1], valleys[i]) / heights[i] for i in range(len(peaks))]
        shallowest = depths.index(max(depths))
        if depths[shallowest] <= _VALLEY:
            borders = np.sort(np.array(cuts) % HUES)
            family = np.searchsorted(borders, np.arange(256), side='right') % len(peaks)
            return family.astype(np.uint8)
        del peaks[shallowest]
    return None
