"""From feature maps to objects: regions, separated where they touch, background left out."""

from dataclasses import dataclass, replace
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import parameter
from ja_perception.core.box import Box
from ja_perception.core.features import ColourMap, Mask, without_specks

# Texture is judged in windows, and rims of a mover are joined over gaps, of these fractions of the
# image's width.
_TEXTURE_SCALE, _MOVER_SCALE = 16, 40
# A region that overlaps one of another detector by this share of the smaller is the same object.
_MERGED_OVERLAP = 0.5
# Parts of one patch are objects of their own when their boxes overlap by less.
_SEPARATE_OVERLAP = 0.4
# OpenCV's hues, in steps of two degrees.
_HUES = 180
_HUE_BLUR = 4
# A hue is a peak of its own when it is this large beside the largest peak, and when the valleys
# beside it are lower than this share of it.
_LEAST_PEAK, _VALLEY = 0.1, 0.4


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
        0.15, 'share of edge pixels around a place from which it is textured', low=0.0, high=1.0
    )


@dataclass(frozen=True)
class Region:
    """A group of pixels: its box, and how many pixels of bright colour are its own [px]."""

    box: Box
    bright_px: int = 0


class Grouping:
    """Groups pixels of feature maps of (H, W) working images into objects."""

    def __init__(self, config: GroupingConfig) -> None:
        self._config = config

    def by_colour(self, colour: ColourMap) -> list[Region]:
        """Regions of bright colour; touching regions of different hues are separated."""
        bright = without_specks(colour.bright)
        smallest = self._smallest(bright)
        labels, patches = _patches(bright, smallest)
        regions = []
        for patch in patches:
            part = np.s_[patch.y : patch.y + patch.height, patch.x : patch.x + patch.width]
            mask = cv2.compare(labels[part], patch.label, cv2.CMP_EQ)
            regions += _by_hue(mask, colour.hue[part], patch, smallest)
        return self._objects(regions, bright)

    def by_texture(self, edges: Mask) -> list[Region]:
        """Places dense with edges."""
        side = texture_window(edges)
        density = cv2.blur(edges * np.uint8(255), (side, side))
        mean, deviation = (float(value[0, 0]) for value in cv2.meanStdDev(density))
        # A picture that is textured all over has no textured object but where it is more so.
        least = max(255 * self._config.edge_density, mean + deviation)
        dense = cv2.compare(density, least, cv2.CMP_GT)
        _, patches = _patches(dense, self._smallest(edges))
        return self._objects([Region(patch.box) for patch in patches], edges)

    def by_motion(self, moving: Mask) -> list[Region]:
        """Regions that move; the rims of one mover are joined."""
        side = max(3, moving.shape[1] // _MOVER_SCALE | 1)
        joined = cv2.morphologyEx(moving, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
        _, patches = _patches(joined, self._smallest(moving))
        return self._objects([Region(patch.box) for patch in patches], moving)

    def _smallest(self, mask: Mask) -> int:
        return max(4, round(self._config.smallest_object_share * mask.size))

    def _objects(self, regions: list[Region], mask: Mask) -> list[Region]:
        return [region for region in regions if not self._is_background(region.box, mask)]

    def _is_background(self, box: Box, mask: Mask) -> bool:
        """Is the region too large, or does it run from one border to the opposite one?"""
        height, width = mask.shape
        return (
            box.area > self._config.largest_object_share * mask.size
            or box.width > width - 2
            or box.height > height - 2
        )


def texture_window(edges: Mask) -> int:
    """Side of the window in which texture is judged [px]."""
    return max(3, edges.shape[1] // _TEXTURE_SCALE | 1)


def merged(*sources: list[Region]) -> list[Region]:
    """Regions of several detectors as one list: what overlaps an earlier one is the same."""
    objects: list[Region] = []
    for regions in sources:
        objects += [
            region
            for region in regions
            if all(region.box.overlap(known.box) < _MERGED_OVERLAP for known in objects)
        ]
    return objects


@dataclass(frozen=True)
class _Patch:
    """A connected patch of a mask: its label there, upper left pixel, size and area [px]."""

    label: int
    x: int
    y: int
    width: int
    height: int
    area: int

    @property
    def box(self) -> Box:
        u, v = self.x + (self.width - 1) / 2, self.y + (self.height - 1) / 2
        return Box(u, v, self.width, self.height)

    def inside(self, outer: '_Patch') -> '_Patch':
        """This patch, found in the cut-out of ``outer``, in the coordinates of the whole."""
        return replace(self, x=self.x + outer.x, y=self.y + outer.y)


def _patches(mask: Mask, smallest: int) -> tuple[NDArray[np.int32], list[_Patch]]:
    """Labels (H, W) of a mask's connected patches, and those of at least ``smallest`` pixels."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    rows = enumerate(stats.tolist())
    patches = [_Patch(label, *row) for label, row in rows if label and row[4] >= smallest]
    return labels, patches


def _by_hue(mask: Mask, hue: NDArray[np.uint8], patch: _Patch, smallest: int) -> list[Region]:
    """A patch's differently coloured parts, or the whole patch where they interleave."""
    whole = [Region(patch.box, patch.area)]
    family = _hue_families(cv2.calcHist([hue], [0], mask, [_HUES], [0, _HUES]).ravel())
    if family is None:
        return whole
    family_of_pixel = np.where(mask > 0, family[hue] + 1, 0)
    families = []
    for number in range(1, int(family.max()) + 2):
        part = (family_of_pixel == number).view(np.uint8)
        part = cv2.morphologyEx(part, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        found = [p.inside(patch) for p in _patches(part, smallest)[1]]
        families.append([Region(p.box, p.area) for p in found])
    parts = [part for family_parts in families for part in family_parts]
    return whole if len(parts) < 2 or _interleave(families) else parts


def _interleave(families: list[list[Region]]) -> bool:
    """Do differently coloured parts lie in each other, or alternate as stripes and dots do?"""
    for mine, theirs in combinations(families, 2):
        if any(a.box.overlap(b.box) > _SEPARATE_OVERLAP for a in mine for b in theirs):
            return True
        alternate = min(len(mine), len(theirs)) > 1
        if alternate and _hull(mine).overlap(_hull(theirs)) > _SEPARATE_OVERLAP:
            return True
    return False


def _hull(regions: list[Region]) -> Box:
    left = min(region.box.left for region in regions)
    top = min(region.box.top for region in regions)
    right = max(region.box.left + region.box.width for region in regions)
    bottom = max(region.box.top + region.box.height for region in regions)
    return Box((left + right) / 2, (top + bottom) / 2, right - left, bottom - top)


def _hue_families(histogram: NDArray[np.float32]) -> NDArray[np.intp] | None:
    """Family number of each of the 180 hues, shape (180,); None when all hues are of one family.

    The hue circle is cut in the valleys between the peaks of its smoothed histogram.
    """
    ring = np.tile(histogram, 3)[None]
    smooth = cv2.GaussianBlur(ring, (0, 0), _HUE_BLUR)[0, _HUES : 2 * _HUES]
    is_peak = (smooth > np.roll(smooth, 1)) & (smooth >= np.roll(smooth, -1))
    peaks = np.flatnonzero(is_peak & (smooth > _LEAST_PEAK * smooth.max())).tolist()
    cuts: list[int] = []
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
            return np.searchsorted(np.sort(cuts), np.arange(_HUES), side='right') % len(peaks)
        del peaks[shallowest]
    return None


def _lowest_between(smooth: NDArray[np.float32], start: int, end: int) -> int:
    """The hue of the lowest value on the way from ``start`` up the circle to ``end``."""
    way = (start + np.arange((end - start) % _HUES or _HUES)) % _HUES
    return int(way[np.argmin(smooth[way])])
