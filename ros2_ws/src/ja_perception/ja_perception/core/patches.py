"""Connected patches of a mask."""

from dataclasses import dataclass, replace

import cv2

from ja_perception.core.box import Box
from ja_perception.core.features import Mask


@dataclass(frozen=True, eq=False)
class Patch:
    """A connected patch: its upper left pixel, its own mask (h, w) of 0 and 1, and its area."""

    x: int
    y: int
    mask: Mask
    area: int

    @property
    def width(self) -> int:
        return self.mask.shape[1]

    @property
    def height(self) -> int:
        return self.mask.shape[0]

    @property
    def box(self) -> Box:
        u, v = self.x + (self.width - 1) / 2, self.y + (self.height - 1) / 2
        return Box(u, v, self.width, self.height)

    def inside(self, outer: 'Patch') -> 'Patch':
        """This patch, found in the cut-out of ``outer``, in the coordinates of the whole."""
        return replace(self, x=self.x + outer.x, y=self.y + outer.y)

    def runs_through(self, image_width: int, image_height: int) -> bool:
        """Does it run on beyond two opposite borders, about as thick there as elsewhere?"""
        return (self.width >= image_width - 2 and _ends_thick(self.mask, self.area)) or (
            self.height >= image_height - 2 and _ends_thick(self.mask.T, self.area)
        )


def _ends_thick(mask: Mask, area: int) -> bool:
    thickness = area / mask.shape[1]
    return min(mask[:, 0].sum(), mask[:, -1].sum()) > thickness / 2


def patches_of(mask: Mask, smallest: int) -> list[Patch]:
    """The connected patches of a mask (H, W) that have at least ``smallest`` pixels."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    patches = []
    for label, (x, y, width, height, area) in enumerate(stats.tolist()):
        if label and area >= smallest:
            own = cv2.compare(labels[y : y + height, x : x + width], label, cv2.CMP_EQ)
            patches.append(Patch(x, y, cv2.min(own, 1), area))
    return patches


def hull(patches: list[Patch]) -> Box:
    """The box around all of several patches."""
    left, top = min(p.x for p in patches), min(p.y for p in patches)
    right = max(p.x + p.width for p in patches)
    bottom = max(p.y + p.height for p in patches)
    return Box((left + right - 1) / 2, (top + bottom - 1) / 2, right - left, bottom - top)
