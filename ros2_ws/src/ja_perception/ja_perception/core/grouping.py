"""From feature maps to objects: regions, separated where they touch, background left out."""

from dataclasses import dataclass
from itertools import accumulate, combinations
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import Configuration, parameter
from ja_perception.core.box import Box, overlaps
from ja_perception.core.features import ColourMap, Mask, remove_specks
from ja_perception.core.hue_families import HUES, ONE_HUE, hue_families
from ja_perception.core.patches import Patch, hull, patches_of

# Texture is measured in windows, and rims of a mover are joined over gaps, of these fractions of
# the image's width.
_TEXTURE_SCALE, _MOVER_SCALE = 16, 40
# A region that overlaps one of another detector by this share of the smaller is the same object.
_MERGED_OVERLAP = 0.5
# Parts of one patch are objects of their own when their boxes overlap by less.
_SEPARATE_OVERLAP = 0.4


@dataclass(frozen=True)
class GroupingConfig(Configuration):
    """Which regions are objects."""

    smallest_object_share: float = parameter(
        0.001, 'smallest area of an object (share of the image)', low=0.0, high=1.0
    )
    largest_object_share: float = parameter(
        0.5, 'a region larger than this share of the image is background', low=0.0, high=1.0
    )
    edge_density: float = parameter(
        0.15, 'share of edge pixels around a place from which it is textured', low=0.0, high=1.0
    )


class Region(NamedTuple):
    """A group of pixels: its box, how many pixels of bright colour are its own [px], and which."""

    box: Box
    bright_px: int = 0
    patch: Patch | None = None


class Grouping:
    """Groups pixels of feature maps of (H, W) working images into objects."""

    def __init__(self, config: GroupingConfig) -> None:
        self._config = config

    def group_by_colour(self, colour: ColourMap) -> list[Region]:
        """Return regions of bright colour; touching regions of different hues are separated."""
        bright = remove_specks(colour.bright)
        smallest = self._smallest(bright)
        parts = []
        for patch in patches_of(bright, smallest):
            rows = slice(patch.y, patch.y + patch.height)
            columns = slice(patch.x, patch.x + patch.width)
            parts += _parts_by_hue(patch, colour.hue[rows, columns], smallest)
        return [
            Region(part.box, part.area, part) for part in self._without_background(parts, bright)
        ]

    def group_by_texture(self, edges: Mask) -> list[Region]:
        """Return the places that are dense with edges."""
        side = texture_window(edges)
        density = cv2.blur(edges * np.uint8(255), (side, side))
        mean, deviation = (float(value[0, 0]) for value in cv2.meanStdDev(density))
        # In a picture that is textured all over, an object must be more textured than the rest.
        least = max(255 * self._config.edge_density, mean + deviation)
        return self._whole_patches(cv2.compare(density, least, cv2.CMP_GT))

    def group_by_motion(self, moving: Mask) -> list[Region]:
        """Return the regions that move; the rims of one mover are joined."""
        side = max(3, moving.shape[1] // _MOVER_SCALE | 1)
        kernel = np.ones((side, side), np.uint8)
        return self._whole_patches(cv2.morphologyEx(moving, cv2.MORPH_CLOSE, kernel))

    def _whole_patches(self, mask: Mask) -> list[Region]:
        # In maps as smooth as these it makes no difference, and 8 neighbours are twice as fast.
        patches = patches_of(mask, self._smallest(mask), neighbours=8)
        return [
            Region(patch.box, patch=patch) for patch in self._without_background(patches, mask)
        ]

    def _smallest(self, mask: Mask) -> int:
        return max(4, round(self._config.smallest_object_share * mask.size))

    def _without_background(self, patches: list[Patch], mask: Mask) -> list[Patch]:
        height, width = mask.shape
        largest = self._config.largest_object_share * mask.size
        return [p for p in patches if p.area <= largest and not p.runs_through(width, height)]


def texture_window(edges: Mask) -> int:
    """Return the side of the window in which texture is measured [px]."""
    return max(3, edges.shape[1] // _TEXTURE_SCALE | 1)


def merge_regions(*sources: list[Region]) -> list[Region]:
    """Merge the regions of several detectors: what overlaps an earlier one is the same."""
    regions = [region for source in sources for region in source]
    boxes = np.array([region.box for region in regions], float)
    same = (overlaps(boxes, boxes) >= _MERGED_OVERLAP).tolist()
    kept: list[int] = []
    for source, first in zip(sources, accumulate(map(len, sources), initial=0), strict=False):
        among = range(first, first + len(source))
        kept += [i for i in among if not any(same[i][known] for known in kept)]
    return [regions[i] for i in kept]


def _parts_by_hue(patch: Patch, hue: NDArray[np.uint8], smallest: int) -> list[Patch]:
    """Return a patch's differently coloured parts, or the whole patch where they interleave."""
    if patch.area < 2 * smallest:
        return [patch]
    least, most, _, _ = cv2.minMaxLoc(hue, patch.mask)
    if most - least < ONE_HUE:
        return [patch]
    histogram = cv2.calcHist([hue], [0], patch.mask, [HUES], [0, HUES]).ravel()
    family = hue_families(histogram)
    if family is None:
        return [patch]
    family_of_pixel = cv2.LUT(hue, family) + np.uint8(1)
    family_of_pixel *= patch.mask
    families = []
    for number in range(1, int(family.max()) + 2):
        mask = cv2.compare(family_of_pixel, number, cv2.CMP_EQ)
        mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        families.append([part.inside(patch) for part in patches_of(mask, smallest)])
    parts = [part for family_parts in families for part in family_parts]
    return [patch] if len(parts) < 2 or _interleave(families) else parts


def _interleave(families: list[list[Patch]]) -> bool:
    """Return whether parts of different colours lie in each other or alternate (stripes, dots)."""
    for mine, theirs in combinations(families, 2):
        shared = overlaps([part.box for part in mine], [part.box for part in theirs])
        if (shared > _SEPARATE_OVERLAP).any():
            return True
        alternate = min(len(mine), len(theirs)) > 1
        if alternate and hull(mine).overlap(hull(theirs)) > _SEPARATE_OVERLAP:
            return True
    return False
