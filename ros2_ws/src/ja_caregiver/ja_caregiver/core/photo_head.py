"""A head in three dimensions from one frontal photograph.

The landmark network gives the face in depth. From the face to the outline of the head the surface
falls back as an ellipsoid does, and a second shell behind it closes the head. The photograph is
the texture; the shell behind the outline repeats what is just inside of it. What this yields are
turned photographs, credible to about 45 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.linalg import spsolve
from scipy.spatial import Delaunay, cKDTree

from ja_caregiver.core.head_outline import NECK_CUT, HeadOutline, Mask, find_outline
from ja_caregiver.core.photo_face import (
    EYES_APART_PX,
    LEFT_EYE,
    RIGHT_EYE,
    PhotoFace,
    PhotoFaceFinder,
)
from ja_sim.core.photo_head_file import PhotoHead, write_photo_head

EYES_APART_M = 0.063
"""Mean distance between the eyes of adults: it sets the size of the head."""

_M_PER_PX = EYES_APART_M / EYES_APART_PX
# Where the middle between the eyeballs lies in the rest frame, and the centre of the face, as with
# the people of the simulator: the neck then stands in the collar.
_EYES_AT = np.array([0.092, 0.0, 0.088])
_FACE_AT = np.array([0.107, 0.0, 0.050])
# From the centre of an eyeball forwards to the corners of the eye.
_TO_SURFACE = np.array([0.011, 0.0, 0.0])
# Landmarks at the edge of the face before the ears, at the chin.
_BEFORE_EARS, _CHIN = (234, 454), 152
# The widest part of the head lies so far behind the landmarks before the ears, and the back of the
# head behind it; the neck's sides lie so far behind those of the head, its front before its sides.
_WIDEST_BEHIND_M, _BACK_M = 0.030, 0.085
_NECK_SIDES_BEHIND_M, _NECK_FRONT_M = 0.025, 0.028
_GRID_PX, _OUTLINE_PX = 4.5, 4.0
# How much the surface follows each landmark, and not smoothness.
_FIT = 0.5
_INSIDE_OUTLINE_PX = 5.0
# What is seen behind the outline repeats the photograph inside of it, stretched by this factor.
_BEHIND_STRETCH, _BEHIND_MOST_PX = 0.35, 14.0
_TEXTURE_MARGIN_PX, _FILL_BLUR_PX = 4, 5.0


def make_photo_head(path: Path, out: Path, finder: PhotoFaceFinder | None = None) -> PhotoHead:
    """Make a head from a photograph and write it into a file (.npz); return it.

    Raises PhotoError for a photograph of which no head can be made, and SaveError.
    """
    head = photo_head((finder or PhotoFaceFinder()).read_photo(path))
    write_photo_head(out, head)
    return head


def photo_head(face: PhotoFace) -> PhotoHead:
    """Return the head of a face, in the rest frame of the caregiver."""
    outline = find_outline(face)
    sheet = _sheet(face, outline.head)
    to_rest = _RestFrame(face)
    front = to_rest.from_depth(sheet.points, sheet.depth)
    back = to_rest.from_depth(sheet.points, sheet.back)
    rim = sheet.on_outline
    # Front and back share the vertices of the outline.
    behind = np.flatnonzero(~rim)
    number = np.arange(len(front))
    number[behind] = len(front) + np.arange(len(behind))
    faces = np.vstack([sheet.triangles, number[sheet.triangles][:, ::-1]])
    vertices = np.vstack([front, back[behind]])
    at = np.vstack([sheet.points, _repeated_inside(sheet.points[behind], outline.head)])
    texture, uv = _texture(face.picture, outline, at)
    eyes = to_rest.eyes()
    return PhotoHead(
        vertices.astype(np.float32),
        _drop_slivers(vertices, faces).astype(np.int32),
        uv.astype(np.float32),
        texture,
        eyes,
        _FACE_AT.copy(),
        *_colours(face, outline.head),
    )


class _RestFrame:
    """Turns pixels of the cut and depths in the head's axes into the caregiver's rest frame.

    Depth [m] is measured along the head's own axis backwards, from the middle of the eyes, so a
    photograph of a head that is turned a little gives a head that looks straight ahead.
    """

    def __init__(self, face: PhotoFace) -> None:
        self._rotation = face.pose.rotation
        corners = face.landmarks[[*LEFT_EYE, *RIGHT_EYE]]
        self._middle = corners.mean(axis=0)
        self._eyes = corners.reshape(2, 2, 3).mean(axis=1)
        # Of her own axes: left, down, backwards.
        apart = self._in_head(self._eyes)
        self._scale = EYES_APART_M / float(np.linalg.norm(apart[0] - apart[1]))

    def landmark_depth(self, landmarks: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the depths (n,) [m] of landmarks (n, 3) [px]."""
        return np.asarray(self._scale * self._in_head(landmarks)[:, 2])

    def from_depth(
        self, points: NDArray[np.float64], depth: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the places (n, 3) [m] of pixels (n, 2) at depths (n,) [m]."""
        flat = points - self._middle[:2]
        axis = self._rotation[:, 2]
        away = (depth / self._scale - flat @ axis[:2]) / axis[2]
        return self._to_rest(np.column_stack([flat, away]) @ self._rotation)

    def eyes(self) -> NDArray[np.float64]:
        """Return the centres (2, 3) [m] of the left and the right eyeball."""
        found = self._to_rest(self._in_head(self._eyes))
        return np.asarray(found - _TO_SURFACE)

    def _in_head(self, landmarks: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray((landmarks - self._middle) @ self._rotation)

    def _to_rest(self, in_head: NDArray[np.float64]) -> NDArray[np.float64]:
        left, down, backwards = self._scale * in_head.T
        return np.asarray(np.column_stack([-backwards, left, -down]) + _EYES_AT + _TO_SURFACE)


@dataclass(frozen=True, eq=False)
class _Sheet:
    """A sheet of triangles over the outline: `points` (n, 2) [px], `depth`, `back` (n,) [m]."""

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    on_outline: NDArray[np.bool_]
    depth: NDArray[np.float64]
    back: NDArray[np.float64]


def _sheet(face: PhotoFace, outline: Mask) -> _Sheet:
    around, grid = _outline_points(outline), _grid_points(outline)
    points = np.vstack([grid, around])
    triangles = _triangles(points, outline)
    on_outline = np.arange(len(points)) >= len(grid)
    known = _RestFrame(face).landmark_depth(face.landmarks)
    chin = face.landmarks[_CHIN, 1]
    cut = face.landmarks[[*LEFT_EYE, *RIGHT_EYE], 1].mean() + NECK_CUT * EYES_APART_PX
    at_ears = known[list(_BEFORE_EARS)].max() + _WIDEST_BEHIND_M

    def widest(rows: NDArray[np.float64]) -> NDArray[np.float64]:
        return at_ears + _NECK_SIDES_BEHIND_M * np.clip((rows - chin) / (cut - chin), 0.0, 1.0)

    # Of an ellipsoid, the square of the distance from its widest section is what changes evenly.
    fixed = np.zeros(len(points))
    # The lower edge is no outline: the neck goes on there.
    edge = on_outline & (points[:, 1] > cut - 1.5 * _OUTLINE_PX)
    fixed[edge] = _NECK_FRONT_M**2 * _round(points[edge, 0])
    seen = np.maximum(widest(face.landmarks[:, 1]) - known, 0.0) ** 2
    laplacian = _laplacian(triangles, len(points))
    squares = _smooth_fit(laplacian, on_outline, fixed, *_nearest(grid, face.landmarks, seen))
    rim = on_outline & ~edge
    behind = widest(points[:, 1])
    depth = behind - np.sqrt(np.maximum(squares, 0.0))
    return _Sheet(points, triangles, rim, depth, behind + _BACK_M * _dome(laplacian, rim))


def _round(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return 1 in the middle of columns (n,), 0 at both ends, as the square of a half circle."""
    left, right = columns.min(), columns.max()
    across = (columns - (left + right) / 2) / ((right - left) / 2)
    return np.asarray(1.0 - across**2)


def _nearest(
    grid: NDArray[np.float64], landmarks: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the points of the grid nearest to landmarks (n, 3), and their mean values there."""
    distance, nearest = cKDTree(grid).query(landmarks[:, :2])
    near = distance < _GRID_PX
    where, which = np.unique(nearest[near], return_inverse=True)
    sums = np.bincount(which, values[near])
    return where.astype(np.int64), sums / np.bincount(which)


def _outline_points(outline: Mask) -> NDArray[np.float64]:
    """Return points (n, 2) [px] along the outline, evenly spaced."""
    found, _ = cv2.findContours(outline.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    line = max(found, key=cv2.contourArea)[:, 0].astype(float)
    kernel = np.ones(5) / 5
    smooth = np.stack(
        [np.convolve(np.pad(each, 2, mode='wrap'), kernel, 'valid') for each in line.T], axis=1
    )
    steps = np.hypot(*np.diff(smooth, axis=0, append=smooth[:1]).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    count = max(32, round(along[-1] / _OUTLINE_PX))
    where = np.linspace(0.0, along[-1], count, endpoint=False)
    closed = np.vstack([smooth, smooth[:1]])
    return np.column_stack([np.interp(where, along, closed[:, k]) for k in (0, 1)])


def _grid_points(outline: Mask) -> NDArray[np.float64]:
    """Return points (n, 2) [px] of a triangular grid within the outline."""
    height, width = outline.shape
    rows = np.arange(_GRID_PX / 2, height, _GRID_PX * np.sqrt(0.75))
    columns = np.arange(_GRID_PX / 2, width, _GRID_PX)
    v, u = np.meshgrid(rows, columns, indexing='ij')
    u[1::2] += _GRID_PX / 2
    points = np.column_stack([u.ravel(), v.ravel()])
    points = points[(points < [width - 1, height - 1]).all(axis=1)]
    to_outline = cv2.distanceTransform(outline.astype(np.uint8), cv2.DIST_L2, 5)
    column, row = np.round(points).astype(int).T
    return points[to_outline[row, column] > 0.6 * _GRID_PX]


def _triangles(points: NDArray[np.float64], outline: Mask) -> NDArray[np.int64]:
    """Return the Delaunay triangles (m, 3) within the outline, clockwise in the picture."""
    found = Delaunay(points).simplices.astype(np.int64)
    column, row = np.round(points[found].mean(axis=1)).astype(int).T
    found = found[outline[row, column]]
    first, second, third = (points[found[:, k]] for k in range(3))
    turn = np.cross(
        np.pad(second - first, ((0, 0), (0, 1))), np.pad(third - first, ((0, 0), (0, 1)))
    )
    # Her left is right in the picture, and up is down: the outside is seen from the camera.
    reverse = turn[:, 2] > 0
    found[reverse] = found[reverse][:, ::-1]
    return found


def _laplacian(triangles: NDArray[np.int64], count: int) -> csr_array:
    """Return the graph Laplacian (count, count) of a mesh."""
    a, b, c = triangles.T
    one, other = np.concatenate([a, b, c]), np.concatenate([b, c, a])
    both = np.concatenate([one, other]), np.concatenate([other, one])
    linked = coo_array((np.ones(len(both[0])), both), shape=(count, count)).tocsr()
    linked.data[:] = 1.0
    return csr_array(diags_array(linked.sum(axis=1)) - linked)


def _smooth_fit(
    laplacian: csr_array,
    is_fixed: NDArray[np.bool_],
    fixed: NDArray[np.float64],
    where: NDArray[np.int64],
    values: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the smoothest values (n,) that are near `values` (m,) at the points `where`.

    Smooth is a small square of the Laplacian; where `is_fixed`, the values are the `fixed` (n,).
    """
    free = np.flatnonzero(~is_fixed)
    bend, pull = laplacian[free][:, free], laplacian[free][:, np.flatnonzero(is_fixed)]
    weights = np.zeros(len(fixed))
    weights[where] = _FIT
    wanted = np.zeros(len(fixed))
    wanted[where] = values
    system = bend.T @ bend + diags_array(weights[free])
    found = fixed.copy()
    right = weights[free] * wanted[free] - bend.T @ (pull @ fixed[is_fixed])
    found[free] = spsolve(system.tocsc(), right)
    return found


def _dome(laplacian: csr_array, fixed: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return heights (n,) of a dome over the mesh: 0 where fixed, 1 at most."""
    free = np.flatnonzero(~fixed)
    height = np.zeros(len(fixed))
    height[free] = spsolve(laplacian[free][:, free].tocsc(), np.ones(len(free)))
    return np.sqrt(np.maximum(height, 0.0) / max(height.max(), 1e-9))


def _repeated_inside(points: NDArray[np.float64], outline: Mask) -> NDArray[np.float64]:
    """Return where the photograph (n, 2) [px] shows what is behind the outline at points (n, 2).

    That is nearer to the outline than the point itself: hair, not the face.
    """
    depth, nearest = distance_transform_edt(outline, return_indices=True)
    column, row = np.round(points).astype(int).T
    inside = depth[row, column]
    edge = nearest[::-1, row, column].T.astype(float)
    far = np.minimum(_BEHIND_STRETCH * inside, _BEHIND_MOST_PX) + _INSIDE_OUTLINE_PX
    share = np.minimum(far / np.maximum(inside, 1e-9), 1.0)
    return np.asarray(edge + share[:, None] * (points - edge))


def _texture(
    picture: NDArray[np.uint8], outline: HeadOutline, at: NDArray[np.float64]
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Return the texture (H, W, 3), and the places (n, 2) in it of pixels (n, 2), 0..1.

    Beyond what is shown the colours of the head go on, so no background shows at its edge.
    """
    sure = distance_transform_edt(outline.shown) > _INSIDE_OUTLINE_PX
    _, nearest = distance_transform_edt(~sure, return_indices=True)
    filled = picture[tuple(nearest)]
    # Without the streaks that single pixels of the edge would draw.
    even = cv2.GaussianBlur(filled, (0, 0), _FILL_BLUR_PX)
    filled = np.where(sure[..., None], filled, even)
    head = outline.head
    rows, columns = np.flatnonzero(head.any(axis=1)), np.flatnonzero(head.any(axis=0))
    low = np.maximum([columns[0], rows[0]], _TEXTURE_MARGIN_PX) - _TEXTURE_MARGIN_PX
    high = np.minimum(
        np.array([columns[-1], rows[-1]]) + _TEXTURE_MARGIN_PX + 1, picture.shape[1::-1]
    )
    texture = np.ascontiguousarray(filled[low[1] : high[1], low[0] : high[0]])
    return texture, np.clip((at - low + 0.5) / (high - low), 0.0, 1.0)


def _drop_slivers(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the faces (m, 3) that have an area."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.asarray(faces[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-10])


def _colours(face: PhotoFace, outline: Mask) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the colours of skin and clothes, RGB in 0..1."""
    picture, points = face.picture, face.landmarks[:, :2]
    skin = np.median(cv2.GaussianBlur(picture, (0, 0), 2.0)[_pixels(points[[50, 280, 151]])], 0)
    cut = np.flatnonzero(outline.any(axis=1))[-1]
    chest = np.zeros(outline.shape, bool)
    middle = round(float(points[_CHIN, 0]))
    wide = round(1.2 * EYES_APART_PX)
    chest[cut + 40 : cut + 110, middle - wide : middle + wide] = True
    shown = picture[chest & face.inside]
    # Without clothes in the picture: grey.
    shirt = np.median(shown, axis=0) if len(shown) > 500 else np.full(3, 100.0)
    return skin / 255.0, shirt / 255.0


def _pixels(points: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    column, row = np.round(points).astype(int).T
    return row, column
