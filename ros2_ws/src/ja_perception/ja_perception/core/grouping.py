"""From feature maps to objects: regions, separated where they touch, background left out."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import parameter
from ja_perception.core.box import Box
from ja_perception.core.features import ColourMap, Mask, without_specks

_HUES = 180
# Two parts of one region are two objects when their boxes share less than this.
_SEPARATE_OVERLAP = 0.4
# A hue peak stands alone when the valley beside it is lower than this share of the peak.
_VALLEY = 0.4
_MERGED_OVERLAP = 0.5
# Hues that span less than this (half degrees) are one hue, and need no closer look.
_ONE_HUE = 20


@dataclass(frozen=True)
class GroupingConfig:
    """Which regions are objects."""

    smallest_object_share: float = parameter(
        0.0006, 'smallest area of an object (share of the image)', low=0.0, high=1.0
    )
    largest_object_share: float = parameter(
        0.35, 'a region larger than this share of the image is background', low=0.0, high=1.0
    )
    edge_density: float = parameter(
        0.35, 'share of edge pixels around a place from which it is textured', low=0.0, high=1.0
    )


class Grouping:
    """Groups pixels of feature maps of (H, W) working images into objects' boxes."""

    def __init__(self, config: GroupingConfig) -> None:
        self._config = config

    def by_colour(self, colour: ColourMap) -> list[Box]:
        """Regions of bright colour; touching regions of different hues are separated."""
        bright = without_specks(colour.bright)
        smallest = self._smallest(bright)
        boxes = []
        labels, regions = _regions(bright, smallest)
        for label, (x, y, w, h) in regions:
            region = (labels[y : y + h, x : x + w] == label).view(np.uint8)
            parts = _hue_parts(region, colour.hue[y : y + h, x : x + w], smallest)
            boxes += [_shifted(box, x, y) for box in parts]
        return [box for box in boxes if not self._is_background(box, bright)]

    def by_texture(self, edges: Mask) -> list[Box]:
        """Places dense with edges."""
        side = max(3, edges.shape[1] // 32 | 1)
        density = cv2.blur(edges * np.uint8(255), (side, side))
        return self._whole_regions((density > 255 * self._config.edge_density).view(np.uint8))

    def by_motion(self, moving: Mask) -> list[Box]:
        """Regions that move; the rims of one mover are joined."""
        side = max(3, moving.shape[1] // 40 | 1)
        return self._whole_regions(
            cv2.morphologyEx(moving, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
        )

    def _whole_regions(self, mask: Mask) -> list[Box]:
        _, regions = _regions(mask, self._smallest(mask))
        boxes = [_box_of(region) for _, region in regions]
        return [box for box in boxes if not self._is_background(box, mask)]

    def _smallest(self, mask: Mask) -> int:
        return max(4, round(self._config.smallest_object_share * mask.size))

    def _is_background(self, box: Box, mask: Mask) -> bool:
        """Is the region too large, or does it run from one border to the opposite one?"""
        height, width = mask.shape
        return (
            box.area > self._config.largest_object_share * mask.size
            or box.width > width - 2
            or box.height > height - 2
        )


def merged(*sources: list[Box]) -> list[Box]:
    """Boxes of several detectors as one list: what overlaps an earlier box is the same object."""
    objects: list[Box] = []
    for boxes in sources:
        new = [b for b in boxes if all(b.overlap(o) < _MERGED_OVERLAP for o in objects)]
        objects += new
    return objects


def _regions(mask: Mask, smallest: int) -> tuple[NDArray, list[tuple[int, tuple]]]:
    """Connected regions of at least ``smallest`` pixels: labels, [(label, (x, y, w, h))]."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    large = [i for i in range(1, count) if stats[i, cv2.CC_STAT_AREA] >= smallest]
    return labels, [(i, tuple(stats[i, :4].tolist())) for i in large]


def _box_of(region: tuple) -> Box:
    x, y, w, h = region
    return Box(x + (w - 1) / 2, y + (h - 1) / 2, w, h)


def _shifted(box: Box, x: float, y: float) -> Box:
    return Box(box.u + x, box.v + y, box.width, box.height)


def _hue_parts(region: Mask, hue: NDArray[np.uint8], smallest: int) -> list[Box]:
    """Boxes of a region's differently coloured parts, or of the whole where they interleave."""
    height, width = region.shape
    whole = _box_of((0, 0, width, height))
    family = _hue_families(hue[region > 0])
    if family is None:
        return [whole]
    family_of_pixel = np.where(region > 0, family[hue] + 1, 0).astype(np.uint8)
    parts = []
    for value in range(1, int(family.max()) + 2):
        mask = (family_of_pixel == value).view(np.uint8)
        mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        parts += [_box_of(part) for _, part in _regions(mask, smallest)[1]]
    interleaved = any(
        a.overlap(b) > _SEPARATE_OVERLAP for i, a in enumerate(parts) for b in parts[:i]
    )
    return [whole] if interleaved or len(parts) < 2 else parts


def _hue_families(hues: NDArray[np.uint8]) -> NDArray[np.intp] | None:
    """Family number of each of the 180 hues, shape (180,); None when all hues are of one family.

    The hue circle is cut in the valleys between the peaks of its smoothed histogram.
    """
    if min(np.ptp(hues), np.ptp((hues.astype(int) + _HUES // 2) % _HUES)) < _ONE_HUE:
        return None
    histogram = np.bincount(hues, minlength=_HUES)[:_HUES].astype(np.float32)
    ring = np.tile(histogram, 3)[None]
    smooth = cv2.GaussianBlur(ring, (0, 0), 4)[0, _HUES : 2 * _HUES]
    is_peak = (smooth > np.roll(smooth, 1)) & (smooth >= np.roll(smooth, -1))
    peaks = np.flatnonzero(is_peak & (smooth > 0.1 * smooth.max()))
    cuts: list[int] = []
    while len(peaks) > 1:
        nexts = np.roll(peaks, -1).tolist()
        cuts = [_lowest_between(smooth, *pair) for pair in zip(peaks.tolist(), nexts, strict=True)]
        # Each peak against the higher of its two valleys: the shallowest one falls first.
        depth = [
            max(smooth[cuts[i - 1]], smooth[cuts[i]]) / smooth[peaks[i]] for i in range(len(peaks))
        ]
        worst = int(np.argmax(depth))
        if depth[worst] <= _VALLEY:
            break
        peaks = np.delete(peaks, worst)
    if len(peaks) < 2:
        return None
    return np.searchsorted(np.sort(cuts), np.arange(_HUES), side='right') % len(peaks)


def _lowest_between(smooth: NDArray[np.float32], start: int, end: int) -> int:
    """The hue of the lowest value on the way from ``start`` up the circle to ``end``."""
    way = (start + np.arange((end - start) % _HUES or _HUES)) % _HUES
    return int(way[np.argmin(smooth[way])])
