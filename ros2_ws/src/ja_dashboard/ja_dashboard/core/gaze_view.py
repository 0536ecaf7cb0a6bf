"""What was read of her face in one image, and how it is drawn into the picture."""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.detection import Detection, caregiver_face
from ja_common.core.face_gaze import FaceGaze

_POINT = (120, 255, 180)
_ARROW = (255, 90, 200)
_ARROW_WIDTHS = 3.0
"""Length of the arrow of a gaze across the line of sight, in widths of the face."""
_EYE_CORNERS = [33, 263]
"""Of the 468 landmarks of a face mesh: the outer corner of each eye."""
# OpenCV cannot draw at pixels much farther out.
_FARTHEST_PX = 30_000.0


@dataclass(frozen=True)
class GazeView:
    """Landmarks (n, 2) [px] of the attended face, and its gaze; empty and None if not read."""

    landmarks: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    gaze: FaceGaze | None = None

    @property
    def direction(self) -> NDArray[np.float64] | None:
        """Return where she looks, yaw and pitch (2,) [rad] as in `FaceGaze`; None if not read.

        The head's angles and the mean of her visible eyes' are added.
        """
        if self.gaze is None:
            return None
        visible = self.gaze.visible
        eyes = self.gaze.eyes[visible].mean(axis=0) if visible.any() else np.zeros(2)
        return self.gaze.head[:2] + eyes


def draw_gaze(
    canvas: NDArray[np.uint8], view: GazeView, detections: list[Detection], scale: float
) -> None:
    """Draw landmarks as points, and the gaze as an arrow, into a picture that is `scale` larger.

    The arrow is the gaze as seen from the camera, without perspective: of one who looks into the
    camera it is a point.
    """
    thick = max(1, round(scale))
    for point in view.landmarks:
        cv2.circle(canvas, _at(point, scale), max(1, thick // 2), _POINT, cv2.FILLED)
    face, direction = caregiver_face(detections), view.direction
    if face is None or direction is None:
        return
    corners = view.landmarks[_EYE_CORNERS] if len(view.landmarks) > max(_EYE_CORNERS) else None
    start = np.array([face.u, face.v]) if corners is None else corners.mean(axis=0)
    yaw, pitch = direction
    # Positive yaw is towards the left of the picture, positive pitch is downwards.
    across = np.array([-np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    end = start + _ARROW_WIDTHS * face.width * across
    cv2.arrowedLine(
        canvas, _at(start, scale), _at(end, scale), _ARROW, 2 * thick, cv2.LINE_AA, tipLength=0.15
    )


def _at(point: NDArray[np.float64], scale: float) -> tuple[int, int]:
    u, v = np.clip((point + 0.5) * scale - 0.5, -_FARTHEST_PX, _FARTHEST_PX)
    return round(u), round(v)
