"""Drawn faces, for learners without a world."""

import numpy as np


def drawn_face(gaze: np.ndarray) -> np.ndarray:
    """Draw a face whose nose, a dark spot, moves with the gaze (left, down) [rad]."""
    rows, columns = np.mgrid[0:30, 0:25]
    column, row = 12 - 8 * gaze[0] / 0.7, 15 + 8 * gaze[1] / 0.3
    spot = np.exp(-((rows - row) ** 2 + (columns - column) ** 2) / 20)
    return (200 - 150 * spot).astype(np.uint8)
