"""Connected patches of a mask."""

from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_perception.core.box import Box
from ja_perception.core.features import Mask


@dataclass(eq=False)
class Patch:
    """A connected patch: its upper left pixel, its size and area [px], and which pixels it has.

    Those are the pixels of ``labels`` (height, width) that carry its ``label``.
    """

    x: int
    y: int
    width: int
    height: int
    area: int
    label: int
    labels: NDArray[np.uint16]

    @cached_property
    def mask(self) -> Mask:
        """Return its own pixels, (height, width) of 0 and 1."""
        return (self.labels == self.label).view(np.uint8)

    @property
    def box(self) -> Box:
        """Return its box [px]."""
        u, v = self.x + (self.width - 1) / 2, self.y + (self.height - 1) / 2
        return Box(u, v, self.width, self.height)

    def inside(self, outer: 'Patch') -> 'Patch':
        """Return this patch, found in the cut-out of ``outer``, in whole-image coordinates."""
        return replace(self, x=self.x + outer.x, y=self.y + outer.y)

    def runs_through(self, image_width: int, image_height: int) -> bool:
        """Return whether it crosses two opposite borders, about as thick there as elsewhere."""
        return (self.width >= image_width - 2 and _ends_thick(self.mask, self.area)) or (
            self.height >= image_height - 2 and _ends_thick(self.mask.T, self.area)
        )


def _ends_thick(mask: Mask, area: int) -> bool:
    thickness = area / mask.shape[1]
    return min(mask[:, 0].sum(), mask[:, -1].sum()) > thickness / 2


def patches_of(mask: Mask, smallest: int, neighbours: int = 4) -> list[Patch]:
    """Return the connected patches of a mask (H, W) that have at least ``smallest`` pixels.

    With 8 ``neighbours`` instead of 4, pixels that touch at a corner are connected.
    """
    left, top, columns, rows = cv2.boundingRect(mask)
    if not columns:
        return []
    _, labels, stats, _ = cv2.connectedComponentsWithStats(
        mask[top : top + rows, left : left + columns], connectivity=neighbours, ltype=cv2.CV_16U
    )
    patches = []
    for label, (x, y, width, height, area) in enumerate(stats.tolist()):
        if label and area >= smallest:
            own = labels[y : y + height, x : x + width]
            patches.append(Patch(left + x, top + y, width, height, area, label, own))
    return patches


def hull(patches: list[Patch]) -> Box:
    """Return the box around all of several patches."""
    left, top = min(p.x for p in patches), min(p.y for p in patches)
    right = max(p.x + p.width for p in patches)
    bottom = max(p.y + p.height for p in patches)
    return Box((left + right - 1) / 2, (top + bottom - 1) / 2, right - left, bottom - top)
