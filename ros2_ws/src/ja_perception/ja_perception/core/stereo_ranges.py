"""The depth of regions by a second camera: matched only where something was detected.

A region of the image is searched in the same rows of the picture of a second camera, which stands
to the right by the baseline B. Both pictures are rectified; a thing that is shifted to the left by
the disparity d stands at the depth z = f B / d.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_calibration import CameraCalibration
from ja_common.core.camera_model import CameraModel
from ja_perception.core.box import Box
from ja_perception.core.features import Mask
from ja_perception.core.ranging import ImageRegion

Picture = NDArray[np.uint8]

# The search is on pictures of at most this width, and then about the match in finer ones: those
# of 640 px make no range better (docs/senses.md), and take twice as long.
_COARSE_WIDTH, _FINE_WIDTH = 160, 320
# A match is believed from this correlation on, and where no other place comes as near as this.
_LEAST_SCORE = 0.6
_SECOND_BELOW = 0.05
# A patch or a place with less contrast than this [grey levels] matches anything.
_LEAST_CONTRAST = 3.0
# A place with less than half of the patch's contrast looks like it by chance only.
_LEAST_CONTRAST_RATIO = 0.5
_LEAST_PIXELS = 12
# A parabola through three scores is off by up to this [px].
_LEAST_DEVIATION_PX = 0.25
# Errors of neighbouring pixels are alike: so many count as one.
_ALIKE = 25.0
_MOST_DEVIATION_PX = 1.0
# A thing has an extent; see also `depth_ranges`.
_LEAST_DEVIATION = 0.01
# Rectified pictures have one focal length, but for the rounding of calibration files.
_SAME_FOCAL = 0.01
_SAME_PLACE_PX = 1
_RIM = np.ones((3, 3), np.uint8)
_SUM = np.ones((1, 3), np.float32)  # of the three colours


@dataclass(frozen=True, eq=False)
class SecondView:
    """A picture (H, W, 3) uint8 RGB of a second camera, rectified, of the time of the image.

    ``focal_baseline``: f B [px m] at this size of the pictures. ``offset_px``: column of the
    optical axis in the image less that in this picture; 0 for most rectified pairs.
    ``quarter_turns``: how often both pictures were turned clockwise by 90 degrees to be upright.
    ``nearest_m``: no thing is nearer.
    """

    image: Picture
    focal_baseline: float
    offset_px: float = 0.0
    quarter_turns: int = 0
    nearest_m: float = 0.3

    def check(self, image: Picture) -> None:
        """Raise ValueError where this picture and the camera's image are no stereo pair."""
        if self.image.shape != image.shape:
            sizes = [f'{picture.shape[1]}x{picture.shape[0]}' for picture in (self.image, image)]
            raise ValueError(
                f'the picture of the second camera is {sizes[0]}, but the image {sizes[1]}: '
                'set both cameras to one size'
            )

    def depths(
        self, image: Picture, regions: Sequence[ImageRegion], camera: CameraModel
    ) -> NDArray[np.float64]:
        """Return the depth z [m] of each region and its deviation [m], shape (n, 2).

        NaN where a region has no contrast, is not seen by the second camera, or is found at
        several places. Raises ValueError as `check`.
        """
        self.check(image)
        found = np.full((len(regions), 2), np.nan)
        if not regions:
            return found
        left, right = (np.rot90(each, self.quarter_turns) for each in (image, self.image))
        left, right = np.ascontiguousarray(left), np.ascontiguousarray(right)
        fine = _Pair(left, right).reduced(_FINE_WIDTH)
        coarse = fine.reduced(_COARSE_WIDTH)
        ratio = fine.scale / coarse.scale
        farthest = self.offset_px
        nearest = farthest + self.focal_baseline / self.nearest_m
        for index, region in enumerate(regions):
            for turn in range(self.quarter_turns % 4):
                region = _turned_back(region, image.shape[1 - turn % 2])
            near = coarse.search(region, farthest * coarse.scale - 1, nearest * coarse.scale + 1)
            if near is None or not coarse.finds_back(region, near.shift):
                continue
            about, around = near.shift * ratio, 1.5 + 0.5 * ratio
            match = fine.search(region, about - around, about + around)
            if match is None or match.deviation_px > _MOST_DEVIATION_PX:
                continue
            disparity = match.shift - self.offset_px * fine.scale
            if disparity > _MOST_DEVIATION_PX:
                depth = self.focal_baseline * fine.scale / disparity
                deviation = depth * match.deviation_px / disparity
                found[index] = depth, math.hypot(deviation, _LEAST_DEVIATION * depth)
        return found


def pair_geometry(
    left: CameraModel, right: CameraCalibration, rectified: bool
) -> tuple[float, float]:
    """Return ``focal_baseline`` and ``offset_px`` of a `SecondView`, for pictures as mounted.

    ``right``: P[0, 3] is -f B, as ROS defines it. ``rectified``: both pictures are. Raises
    ValueError where the pair is not rectified, or P holds no baseline to the right.
    """
    camera = right.camera(left.width, left.height, rectified=True)
    if camera is None or not any(right.p):
        raise ValueError('the second camera is not calibrated: P of its camera_info is zero')
    if left.lens is not None or (any(right.d) and not rectified):
        raise ValueError(
            'a second camera needs images without lens distortion: remap image_raw and '
            'right/image_raw to the rectified ones (image_rect), and set image_geometry to '
            'rectified'
        )
    if abs(camera.fx - left.fx) > _SAME_FOCAL * left.fx:
        raise ValueError(
            f'the two cameras have the focal lengths {left.fx:.1f} and {camera.fx:.1f} px: they '
            'are not rectified as a pair; calibrate them together, and use image_rect of both'
        )
    baseline_m = -right.p[3] / right.p[0]
    if not (math.isfinite(baseline_m) and baseline_m > 0):
        raise ValueError(
            f'P of the second camera holds no baseline to the right: P[0, 3] is {right.p[3]:g}, '
            'and must be below 0 (minus focal length times baseline); calibrate the cameras '
            'together, or swap left and right'
        )
    return camera.fx * baseline_m, left.cx - camera.cx


class _Match(NamedTuple):
    """Where a patch was found: so far to the left [px], and the deviation of that."""

    shift: float
    deviation_px: float


class _Pair:
    """Two rectified pictures (H, W, 3), reduced by ``scale``. Shifts are in their pixels."""

    def __init__(self, left: Picture, right: Picture, scale: float = 1.0) -> None:
        self._left, self._right = left, right
        self.scale = scale

    def reduced(self, most_width: int) -> '_Pair':
        """Return the pair at this width at most."""
        height, width = self._left.shape[:2]
        if width <= most_width:
            return self
        size = (most_width, max(1, round(height * most_width / width)))
        left, right = (
            cv2.resize(each, size, interpolation=cv2.INTER_AREA)
            for each in (self._left, self._right)
        )
        return _Pair(left, right, self.scale * most_width / width)

    def search(self, region: ImageRegion, least: float, most: float) -> _Match | None:
        """Return where a region is found, shifted to the left by ``least`` to ``most``.

        None where it is found nowhere, or at several places.
        """
        placed = self._placed(region)
        if placed is None:
            return None
        x, y, mask = placed
        height, width = mask.shape
        patch = self._left[y : y + height, x : x + width]
        first, last = max(0, x - math.ceil(most)), max(0, x - math.floor(least) + width)
        scores = _correlation(patch, mask, self._right[y : y + height, first:last])
        if scores is None:
            return None
        return _match(scores, x - first, cv2.countNonZero(mask))

    def finds_back(self, region: ImageRegion, shift: float) -> bool:
        """Return whether what was found at a shift is itself found at the region, and only there.

        So it is not where the second camera sees a twin of a thing that is hidden from it.
        """
        placed = self._placed(region)
        if placed is None:
            return False
        x, y, mask = placed
        height, width = mask.shape
        there = x - round(shift)
        patch = self._right[y : y + height, there : there + width]
        first, last = max(0, there - 1), x + width + max(1, round(shift))
        scores = _correlation(patch, mask, self._left[y : y + height, first:last])
        best = None if scores is None else _only_peak(scores)
        return best is not None and abs(first + best - x) <= _SAME_PLACE_PX

    def _placed(self, region: ImageRegion) -> tuple[int, int, Mask] | None:
        """Return the left upper pixel (x, y) of a region and its own pixels (height, width).

        None where too little of it is in the picture. A rim of a pixel is added to a thing's own
        pixels: a plain thing has contrast at its edge only.
        """
        box, rim = region.box.scaled(self.scale), 0 if region.mask is None else 1
        width, height = max(1, round(box.width)), max(1, round(box.height))
        x, y = round(box.left + 0.5) - rim, round(box.top + 0.5) - rim
        if region.mask is None:
            mask = np.ones((height, width), np.uint8)
        else:
            mask = region.mask
            if mask.shape != (height, width):
                mask = cv2.resize(mask, (width, height), interpolation=cv2.INTER_NEAREST)
            mask = cv2.copyMakeBorder(mask, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
            mask = cv2.dilate(mask, _RIM)
        rows, columns = self._left.shape[:2]
        left, top = max(0, -x), max(0, -y)
        mask = mask[top : max(top, rows - y), left : max(left, columns - x)]
        if not mask.size or cv2.countNonZero(mask) < _LEAST_PIXELS:
            return None
        return x + left, y + top, np.ascontiguousarray(mask)


def _correlation(patch: Picture, mask: Mask, strip: Picture) -> list[float] | None:
    """Return the correlation of a patch at all its places in a strip of the same height.

    Only pixels of the mask count. All colours are compared with one mean: a plain thing in
    colour then has a contrast of its own. None where the patch has too little contrast or the
    strip is smaller.
    """
    if strip.shape[1] < patch.shape[1]:
        return None
    own = mask.astype(np.float32)
    samples = 3 * cv2.countNonZero(mask)
    mean = sum(cv2.mean(patch, mask)[:3]) / 3
    # OpenCV's own arithmetic: NumPy's takes ten times as long for pictures so small.
    values = cv2.multiply(
        cv2.subtract(patch, (mean,) * 4, dtype=cv2.CV_32F), cv2.merge([own, own, own])
    )
    contrast = cv2.norm(values, cv2.NORM_L2SQR)
    if contrast < samples * _LEAST_CONTRAST**2:
        return None
    there = cv2.subtract(strip, (mean,) * 4, dtype=cv2.CV_32F)
    products = cv2.matchTemplate(there, values, cv2.TM_CCORR)
    sums, squares = (
        cv2.matchTemplate(cv2.transform(each, _SUM), own, cv2.TM_CCORR)
        for each in (there, cv2.multiply(there, there))
    )
    contrasts = np.maximum(squares - sums * sums / samples, _LEAST_CONTRAST_RATIO**2 * contrast)
    return (products / np.sqrt(contrast * contrasts))[0].tolist()


def _only_peak(scores: list[float]) -> int | None:
    """Return the index of the highest score; None where it is low, or another peak is as high."""
    top = max(scores)
    first = last = scores.index(top)
    while first > 0 and scores[first - 1] < scores[first]:
        first -= 1
    while last < len(scores) - 1 and scores[last + 1] < scores[last]:
        last += 1
    others = max([*scores[:first], *scores[last + 1 :]], default=-1.0)
    return None if top < max(_LEAST_SCORE, others + _SECOND_BELOW) else scores.index(top)


def _match(scores: list[float], start: int, pixels: int) -> _Match | None:
    """Return the shift of the only peak of scores, by a parabola; None where there is none.

    ``start``: the place of shift 0. A peak at an end is none: what is beyond may be higher. The
    deviation is that of the place of a maximum whose height is known from so many ``pixels``.
    """
    best = _only_peak(scores)
    if best is None or not 0 < best < len(scores) - 1:
        return None
    before, top, after = scores[best - 1 : best + 2]
    bend = 2 * top - before - after
    place = best + 0.5 * (after - before) / bend
    unlike = max(0.0, 1 - top)
    deviation = math.sqrt(2 * unlike * _ALIKE / (bend * pixels))
    return _Match(start - place, math.hypot(deviation, _LEAST_DEVIATION_PX))


def _turned_back(region: ImageRegion, width: int) -> ImageRegion:
    """Return a region of an image of this width turned counter-clockwise by 90 degrees."""
    box, mask = region
    turned = Box(box.v, width - 1 - box.u, box.height, box.width)
    return ImageRegion(turned, None if mask is None else np.ascontiguousarray(np.rot90(mask)))
