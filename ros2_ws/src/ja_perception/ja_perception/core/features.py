"""The three primitive features of Eq. 1 as maps: bright colour, edges, motion.

All maps have the size of the working image and hold 0 or 1 (uint8), so that the amount of a
feature inside a box is a sum of an integral image.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.config import parameter

Mask = NDArray[np.uint8]


@dataclass(frozen=True)
class FeatureConfig:
    """What counts as a bright colour, an edge, a motion."""

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
    """Pixels whose colour is saturated and not dark, with their hue, of an (H, W, 3) RGB image."""
    hsv = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV)
    least = (0.0, 255 * config.colour_saturation, 255 * config.colour_value)
    bright = cv2.inRange(hsv, least, (255.0, 255.0, 255.0))
    return ColourMap(cv2.min(bright, 1), cv2.extractChannel(hsv, 0))


def edge_map(grey: Mask, config: FeatureConfig) -> Mask:
    """Pixels at which the brightness of an (H, W) image steps."""
    threshold = 255 * config.edge_contrast
    across = cv2.absdiff(grey[:, 1:], grey[:, :-1])
    down = cv2.absdiff(grey[1:], grey[:-1])
    edges = np.zeros_like(grey)
    edges[:, 1:] = across > threshold
    edges[1:] |= down > threshold
    return edges


def motion_map(grey: Mask, expected: Mask, seen_before: Mask, config: FeatureConfig) -> Mask:
    """Pixels whose brightness is not found near the same place in the ``expected`` image.

    Each pixel may take any brightness that its 3x3 neighbours were expected to have: an error of
    one pixel in the compensation of the head's motion is no motion. Where ``seen_before`` is 0
    nothing is expected, and nothing moves. A change of light over the whole view is no motion.
    """
    if not seen_before.any():
        return np.zeros_like(grey)
    # Detail as fine as the pixels looks different after every shift by part of a pixel.
    grey, expected = cv2.blur(grey, (3, 3)), cv2.blur(expected, (3, 3))
    lighter = cv2.mean(grey, seen_before)[0] - cv2.mean(expected, seen_before)[0]
    tolerance = 255 * config.motion_contrast
    kernel = np.ones((3, 3), np.uint8)
    highest = cv2.add(cv2.dilate(expected, kernel), lighter + tolerance)
    lowest = cv2.add(cv2.erode(expected, kernel), lighter - tolerance)
    moving = (grey > highest) | (grey < lowest)
    return without_specks(moving.view(np.uint8)) & seen_before


def without_specks(mask: Mask) -> Mask:
    """The mask without what is thinner than two pixels: noise."""
    kernel = np.ones((2, 2), np.uint8)
    # Opposite anchors: with its default ones an even kernel shifts the mask by a pixel.
    return cv2.dilate(cv2.erode(mask, kernel, anchor=(0, 0)), kernel, anchor=(1, 1))
