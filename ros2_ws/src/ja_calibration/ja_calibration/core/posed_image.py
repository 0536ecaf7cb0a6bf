"""Images with the measured posture, and points that are tracked from one image to another."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

_MOST_POINTS = 120
_FOUND_AGAIN_PX = 0.5


@dataclass(frozen=True)
class PosedImage:
    """A grey image (H, W) uint8, its stamp, and the joints' angles (2,) [rad] at that stamp."""

    grey: NDArray[np.uint8]
    stamp_ns: int
    angles: NDArray[np.float64]


def mean_image(images: Sequence[PosedImage]) -> PosedImage:
    """Average images of a head at rest: less noise in the pixels and in the encoders."""
    grey = np.mean([image.grey for image in images], axis=0).round().astype(np.uint8)
    angles = np.mean([image.angles for image in images], axis=0)
    return PosedImage(grey, images[-1].stamp_ns, angles)


class TrackedPoints:
    """Corners of one image that optical flow finds again in others.

    Raises ValueError when the image has too few: a blank wall, or the dark.
    """

    def __init__(self, grey: NDArray[np.uint8], at_least: int = 20) -> None:
        self._grey = grey
        distance = max(4, min(grey.shape) // 30)
        found = cv2.goodFeaturesToTrack(grey, _MOST_POINTS, 0.005, distance)
        if found is None or len(found) < at_least:
            count = 0 if found is None else len(found)
            raise ValueError(
                f'only {count} points in the image can be tracked; {at_least} are needed: '
                'let the camera see a room with light and things in it'
            )
        self.pixels: NDArray[np.float32] = found[:, 0]

    def find_in(
        self, grey: NDArray[np.uint8], guess: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Return where the points are in another image, (N, 2) [px]; NaN for those not found.

        A point counts as found when the flow back ends where it started. `guess` (2,) [px]: the
        motion of all points to start from.
        """
        start = self.pixels if guess is None else (self.pixels + guess).astype(np.float32)
        there = self._flow(self._grey, grey, self.pixels, start)
        back = self._flow(grey, self._grey, there, self.pixels)
        lost = np.hypot(*(back - self.pixels).T) > _FOUND_AGAIN_PX
        found = there.astype(float)
        found[lost | ~np.isfinite(back).all(axis=1)] = np.nan
        return found

    def _flow(
        self,
        before: NDArray[np.uint8],
        after: NDArray[np.uint8],
        points: NDArray[np.float32],
        start: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        found, status, _ = cv2.calcOpticalFlowPyrLK(
            before, after, points, start.copy(),
            winSize=(21, 21), maxLevel=4, flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        )  # fmt: skip
        found[status[:, 0] == 0] = np.nan
        return found
