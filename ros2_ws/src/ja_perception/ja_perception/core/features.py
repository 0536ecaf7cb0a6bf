"""The three primitive features of Eq. 1 as maps: bright colour, edges, motion.

All maps have the size of the working image and hold 0 or 1 (uint8), so that the amount of a
feature inside a box is a sum of an integral image.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import Configuration, parameter

Mask = NDArray[np.uint8]

_NEIGHBOURS = np.ones((3, 3), np.uint8)
_SPECK = np.ones((2, 2), np.uint8)


@dataclass(frozen=True)
class FeatureConfig(Configuration):
    """Thresholds of the features."""

    colour_saturation: float = parameter(
        0.5, 'HSV saturation from which a colour is bright (0-1)', low=0.0, high=1.0
    )
    colour_value: float = parameter(
        0.25, 'HSV value from which a colour is bright (0-1)', low=0.0, high=1.0
    )
    edge_contrast: float = parameter(
        0.12, 'step in brightness between neighbours that is an edge (share of the full range)',
        low=0.0, high=1.0,
    )  # fmt: skip
    motion_contrast: float = parameter(
        0.08, 'change in brightness between images that is a motion (share of the full range)',
        low=0.0, high=1.0,
    )  # fmt: skip


@dataclass(frozen=True)
class ColourMap:
    """Where the colour is bright, and which hue it has (0-179, OpenCV's half degrees)."""

    bright: Mask
    hue: NDArray[np.uint8]


def colour_map(rgb: NDArray[np.uint8], config: FeatureConfig) -> ColourMap:
    """Return where an (H, W, 3) RGB image is saturated and not dark, and each pixel's hue."""
    hsv = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV)
    least = (0.0, 255 * config.colour_saturation, 255 * config.colour_value)
    bright = cv2.inRange(hsv, least, (255.0, 255.0, 255.0))
    return ColourMap(bright & 1, cv2.extractChannel(hsv, 0))


def edge_map(grey: Mask, config: FeatureConfig) -> Mask:
    """Return the pixels at which the brightness of an (H, W) image steps."""
    steps = np.zeros_like(grey)
    cv2.absdiff(grey[:, 1:], grey[:, :-1], dst=steps[:, 1:])
    cv2.max(steps[1:], cv2.absdiff(grey[1:], grey[:-1]), dst=steps[1:])
    return _above(steps, 255 * config.edge_contrast)


def motion_map(grey: Mask, expected: Mask, config: FeatureConfig) -> Mask:
    """Return the pixels whose brightness does not occur nearby in the ``expected`` image.

    Each pixel may take any brightness that its 3x3 neighbours were expected to have: an error of
    one pixel in the compensation of the head's motion is no motion. Where 0 is expected there was
    no view, and nothing moves. A change of light over the whole view is no motion.
    """
    lighter = round(cv2.mean(grey, expected)[0] - cv2.mean(expected, expected)[0])
    in_same_light = cv2.subtract(grey, lighter) if lighter else grey
    too_light = cv2.subtract(in_same_light, cv2.dilate(expected, _NEIGHBOURS))
    too_dark = cv2.subtract(cv2.erode(expected, _NEIGHBOURS), in_same_light)
    moving = _above(cv2.max(too_light, too_dark), 255 * config.motion_contrast)
    return cv2.copyTo(remove_specks(moving), expected)


def remove_specks(mask: Mask) -> Mask:
    """Return the mask without what is thinner than two pixels: noise."""
    # Opposite anchors: with its default ones an even kernel shifts the mask by a pixel.
    return cv2.dilate(cv2.erode(mask, _SPECK, anchor=(0, 0)), _SPECK, anchor=(1, 1))


def _above(values: Mask, threshold: float) -> Mask:
    """Return 1 where a value is above the threshold, else 0."""
    return cv2.threshold(values, threshold, 1, cv2.THRESH_BINARY)[1]
