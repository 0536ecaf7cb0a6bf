"""Drawn pictures: a face that face detectors detect, and coloured discs."""

import cv2
import numpy as np

_SHIFT = 4


def room(width: int = 320, height: int = 240) -> np.ndarray:
    """Return an (H, W, 3) RGB picture of a grey-blue wall."""
    return np.full((height, width, 3), (150, 160, 170), np.uint8)


def draw_face(canvas: np.ndarray, u: float, v: float, width: float, look: float = 0.0) -> None:
    """Draw a face around (u, v) [px]; ``look`` (-1 to 1) turns its features to the side."""

    def ellipse(du, dv, a, b, colour):
        centre = round((u + du * width) * 16), round((v + dv * width) * 16)
        axes = round(a * width * 16), round(b * width * 16)
        cv2.ellipse(canvas, centre, axes, 0, 0, 360, colour, cv2.FILLED, cv2.LINE_AA, _SHIFT)

    side = 0.12 * look
    ellipse(0, -0.12, 0.56, 0.72, (60, 40, 30))
    ellipse(0, 0, 0.48, 0.63, (224, 180, 150))
    for eye in (-0.2, 0.2):
        ellipse(eye + side, -0.12, 0.1, 0.055, (250, 250, 250))
        ellipse(eye + side + 0.04 * look, -0.12, 0.05, 0.05, (60, 40, 30))
        ellipse(eye + side, -0.24, 0.13, 0.025, (60, 40, 30))
    ellipse(1.4 * side, 0.08, 0.05, 0.12, (205, 155, 125))
    ellipse(side, 0.33, 0.17, 0.05, (180, 80, 80))


def draw_ball(canvas: np.ndarray, u: float, v: float, radius: float, colour=(220, 30, 30)) -> None:
    """Draw a disc of one colour around (u, v) [px]."""
    centre = round(u * 16), round(v * 16)
    cv2.circle(canvas, centre, round(radius * 16), colour, cv2.FILLED, cv2.LINE_AA, _SHIFT)
