"""The outline of the head in an upright photograph: hair, ears and neck, without the background.

GrabCut (Rother, Kolmogorov and Blake 2004) parts head and background, from what the landmarks say:
the face is certainly hers, and what is farther away than any hair is not. Where the colours do not
part them, an outline of usual proportions remains.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_caregiver.core.photo_face import EYES_APART_PX, PhotoFace

Mask = NDArray[np.bool_]

NECK_CUT = 2.2
"""The head ends so far below the eyes, in distances between the eyes."""

# GrabCut sees the picture reduced: its time grows with the pixels.
_ITERATIONS, _REDUCED = 5, 2
_SMOOTHING_PX = 3.0
# Half-axes (sideways, up) of ellipses around the face, in halves of its width and height.
_SKULL, _LIKELY, _WITH_HAIR, _FARTHEST = (0.9, 1.2), (1.12, 1.42), (1.25, 1.5), (1.95, 2.15)
_OF_CUT_OFF_HAIR = (1.3, 1.25)
# Half the neck's width, in halves of the face's width: what is certain, usual, and never less.
_SURE_NECK, _NECK, _LEAST_NECK = 0.25, 0.62, 0.45
_HAIR_AT_CHIN, _HAIR_AT_CUT = 1.6, 0.75
# The landmarks may lie a little beyond the edge of the face.
_SURE_FACE_PX = 12.0
# Beyond these shares of the usual area, GrabCut has not found the head.
_CREDIBLE = (0.55, 1.75)


@dataclass(frozen=True, eq=False)
class HeadOutline:
    """Masks (H, W) of the cut: `head` is one piece without holes, `shown` where she is seen.

    The head may reach beyond what is shown: where the photograph ends, or where the landmarks of
    her face lie on the background.
    """

    head: Mask
    shown: Mask


def find_outline(face: PhotoFace) -> HeadOutline:
    """Return the outline of the head in the cut of a photograph."""
    shapes = _Shapes(face)
    found = _grab(face.picture, shapes, face.inside) & shapes.farthest
    usual = shapes.with_hair | shapes.neck
    share = found.sum() / usual.sum()
    if not _CREDIBLE[0] < share < _CREDIBLE[1]:
        found = usual
    # Where the photograph ends above her eyes, the usual outline goes on.
    cut_off = ~face.inside & shapes.above_eyes
    found &= ~cut_off | shapes.of_cut_off_hair
    shown = _one_piece(found | shapes.sure)
    head = _one_piece(shown | shapes.face | shapes.skull | shapes.least_neck)
    return HeadOutline(head | shown, shown)


class _Shapes:
    """Where head and background certainly are, or may be, by the landmarks of the face."""

    def __init__(self, face: PhotoFace) -> None:
        points = face.landmarks[:, :2]
        height, width = face.picture.shape[:2]
        rows, columns = np.mgrid[:height, :width].astype(float)
        left, right = points[:, 0].min(), points[:, 0].max()
        top, chin = points[:, 1].min(), points[:, 1].max()
        half, tall = (right - left) / 2, (chin - top) / 2
        eyes = face.landmarks[[33, 133, 263, 362], 1].mean()
        cut = eyes + NECK_CUT * EYES_APART_PX
        aside = np.abs(columns - (left + right) / 2) / half
        from_chin = np.abs(columns - points[152, 0]) / half

        def ellipse(axes: tuple[float, float]) -> Mask:
            up = np.where(rows < eyes, (eyes - rows) / (tall * axes[1]), 0.0)
            # Below the eyes the sides go straight down to where hair ends.
            return np.asarray(np.hypot(aside / axes[0], up) < 1.0)

        hull = np.zeros((height, width), np.uint8)
        cv2.fillConvexPoly(hull, cv2.convexHull(np.round(points).astype(np.int32)), 1)
        self.face = hull > 0
        self.above_eyes = rows < eyes
        below = np.clip((rows - chin) / (cut - chin), 0.0, 1.0)
        taper = aside < _HAIR_AT_CHIN + (_HAIR_AT_CUT - _HAIR_AT_CHIN) * below
        under_face = (rows < cut) & (rows > (eyes + chin) / 2)
        self.neck = under_face & (from_chin < _NECK)
        self.least_neck = under_face & (from_chin < _LEAST_NECK)
        usual_face = np.hypot(aside, np.abs(rows - (top + chin) / 2) / tall) < 1.08
        self.with_hair = (ellipse(_WITH_HAIR) & self.above_eyes) | usual_face
        self.farthest = ellipse(_FARTHEST) & taper & (rows < cut)
        self.of_cut_off_hair = ellipse(_OF_CUT_OFF_HAIR)
        self.skull = ellipse(_SKULL) & self.above_eyes
        self.likely = (ellipse(_LIKELY) & self.above_eyes) | self.face | self.neck
        inner = cv2.distanceTransform(hull, cv2.DIST_L2, 5) > _SURE_FACE_PX
        self.sure = inner | (under_face & (from_chin < _SURE_NECK))


def _grab(picture: NDArray[np.uint8], shapes: _Shapes, inside: Mask) -> Mask:
    height, width = picture.shape[:2]
    labels = np.full((height, width), cv2.GC_BGD, np.uint8)
    labels[shapes.farthest] = cv2.GC_PR_BGD
    labels[shapes.likely] = cv2.GC_PR_FGD
    # Repeated borders are no background: their colours may be hers.
    labels[~inside] = cv2.GC_PR_BGD
    labels[shapes.sure] = cv2.GC_FGD
    small = (width // _REDUCED, height // _REDUCED)
    known = cv2.resize(labels, small, interpolation=cv2.INTER_NEAREST)
    bgr = cv2.cvtColor(cv2.resize(picture, small, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2BGR)
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.setRNGSeed(0)
    cv2.grabCut(bgr, known, None, *models, _ITERATIONS, cv2.GC_INIT_WITH_MASK)
    found = ((known == cv2.GC_FGD) | (known == cv2.GC_PR_FGD)).astype(np.float32)
    return np.asarray(cv2.resize(found, (width, height), interpolation=cv2.INTER_LINEAR) > 0.5)


def _one_piece(head: Mask) -> Mask:
    """Return the largest piece, smooth and without holes."""
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (9, 9))
    opened = cv2.morphologyEx(head.astype(np.uint8), cv2.MORPH_OPEN, kernel)
    smooth = cv2.GaussianBlur(opened.astype(np.float32), (0, 0), _SMOOTHING_PX) > 0.5
    outlines, _ = cv2.findContours(
        smooth.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    largest = max(outlines, key=cv2.contourArea)
    filled = np.zeros(head.shape, np.uint8)
    cv2.drawContours(filled, [largest], -1, 1, cv2.FILLED)
    return filled > 0
