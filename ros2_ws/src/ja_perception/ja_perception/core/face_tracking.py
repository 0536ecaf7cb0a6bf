"""Tracks faces from image to image: where to search for them, and which is the caregiver's.

A face is stored by its direction from the base, so that the head's own motion does not lose it.
An image is searched where the caregiver is expected, unless her face is unchanged, and in the next
square of a scan that covers the picture in several sizes. That is one search an image; two where
she is missing, or where the scan has waited for long.
"""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.config import Configuration, parameter
from ja_common.core.geometry import angle_between, directions_of_rays, rays_of_directions
from ja_common.core.stamps import NS_PER_S
from ja_perception.core.box import Box
from ja_perception.core.face_crop import FACE_COLUMNS, FACE_ROWS, crop_face
from ja_perception.core.faces import Face, FaceFinder, suppress_non_maxima

# A search for a known face takes this many face widths: the detectors are trained on that.
_SEARCH_WIDTHS = 2.5
# A search of more than this share of the picture takes the whole.
_NEARLY_WHOLE = 0.6
# Smaller faces hold too few pixels to be detected.
_LEAST_FACE_PX = 20
# A square of the scan is this many times smaller than the next larger one.
_SCAN_STEP = 0.6
_SCAN_OVERLAP = 0.3
# Detections that share more than this are of one face.
_SAME_OVERLAP = 0.3
# A resting face is found within this distance from its mean (in face widths).
_JITTER_WIDTHS = 0.06
# A face whose width differs by this share has moved nearer or farther away.
_OTHER_SIZE = 0.3
_SIZES = 100
# A face whose picture differs by less (3 grey levels a pixel) is unchanged.
_UNCHANGED_L1 = 3 * FACE_ROWS * FACE_COLUMNS


@dataclass(frozen=True)
class FaceConfig(Configuration):
    """How faces are searched for and tracked."""

    new_face_score: float = parameter(
        0.7, 'confidence that a new face needs in two searches', low=0.0, high=1.0
    )
    smallest_face_share: float = parameter(
        0.0625, 'smallest face searched for (share of the width of the image)', low=0.01, high=1.0
    )
    scan_every: int = parameter(
        5,
        'images from one step of the scan to the next while the caregiver is known (twice as many '
        'while she moves)',
        low=1, high=1000,
    )  # fmt: skip
    hold_face_s: float = parameter(
        0.5, 'time for which a face that is not found again still counts as seen',
        low=0.0, high=10.0,
    )  # fmt: skip
    forget_face_s: float = parameter(
        1.5, 'time in view without being found after which a face is forgotten',
        low=0.0, high=60.0,
    )  # fmt: skip
    face_averaging: int = parameter(
        20, 'detections over which the place of a resting face is averaged', low=1, high=1000
    )


class FaceTrack:
    """A face over time, smoothed: the detector's box jitters, and jitter would look like gaze.

    The direction is averaged while the detections stay within the detector's jitter, and follows
    at once when they do not: a head that turns carries its box along. The size shows only how far
    away the person is; it is averaged for longer.
    """

    def __init__(self, track_id: int) -> None:
        self.track_id = track_id
        self.score = 0.0
        self.missed_s = 0.0
        """Time in view since it was last found."""
        self._direction = np.zeros(2)
        self._size = np.zeros(2)
        self._detections = 0
        self._sizes = 0
        self._picture: NDArray[np.uint8] | None = None

    def update(self, direction: ArrayLike, size: ArrayLike, score: float, longest: int) -> None:
        """Update from a detection: direction [rad], box size (width, height) at unit focal length.

        ``longest``: detections of a resting face over which its direction is averaged.
        """
        direction, size = np.asarray(direction, float), np.asarray(size, float)
        if angle_between(direction, self._direction) > _JITTER_WIDTHS * size[0]:
            self._detections = 0
        if abs(size[0] - self._size[0]) > _OTHER_SIZE * self._size[0]:
            self._sizes = 0
        self._detections = min(self._detections + 1, longest)
        self._sizes = min(self._sizes + 1, _SIZES)
        self._direction = self._direction + (direction - self._direction) / self._detections
        self._size = self._size + (size - self._size) / self._sizes
        self.score, self.missed_s = score, 0.0

    def ray(self, posture: ArrayLike) -> NDArray[np.float64]:
        """Return the ray (x, y) to the face from a posture; NaN when behind."""
        return rays_of_directions(posture, self._direction)

    def box(self, camera: CameraModel, posture: ArrayLike) -> Box:
        """Return the box of the face in the image from a posture [px]; NaN when behind."""
        u, v = camera.pixels(self.ray(posture)).tolist()
        width, height = (self._size * (camera.fx, camera.fy)).tolist()
        return Box(u, v, width, height)

    def store_picture(self, grey: NDArray[np.uint8], box: Box) -> None:
        """Store its picture, cut from an (H, W) image, for ``is_unchanged``."""
        self._picture = crop_face(grey, box)

    def is_unchanged(self, grey: NDArray[np.uint8], box: Box) -> bool:
        """Return whether the face looks as it did when it was last found."""
        if self._picture is None:
            return False
        return cv2.norm(crop_face(grey, box), self._picture, cv2.NORM_L1) < _UNCHANGED_L1


@dataclass(frozen=True)
class _ImageView:
    """An image, also in grey, with its camera and posture."""

    image: NDArray[np.uint8]
    grey: NDArray[np.uint8]
    camera: CameraModel
    posture: NDArray[np.float64]

    def box(self, face: FaceTrack) -> Box:
        """Return the box of a face in this image [px]."""
        return face.box(self.camera, self.posture)

    def shows(self, face: FaceTrack) -> bool:
        """Return whether the place of a face lies in this image."""
        return self.camera.contains(self.camera.pixels(face.ray(self.posture)))


class FaceTracker:
    """Finds faces in image after image with any ``FaceFinder``."""

    def __init__(self, finder: FaceFinder, config: FaceConfig) -> None:
        self._finder = finder
        self._config = config
        self._faces: list[FaceTrack] = []
        self._caregiver: FaceTrack | None = None
        self._next_id = 0
        self._scan_place = -1
        self._until_scan = 0
        self._stamp_ns: int | None = None

    def update(
        self,
        image: NDArray[np.uint8],
        grey: NDArray[np.uint8],
        camera: CameraModel,
        posture: NDArray[np.float64],
        stamp_ns: int,
    ) -> list[FaceTrack]:
        """Return the faces in view of an (H, W, 3) RGB image, the caregiver's first.

        ``grey``: the same image, (H, W). ``posture``: (pan, tilt) [rad] at its stamp. The
        caregiver is the largest face when none was known, and stays so until her face is
        forgotten.
        """
        view = _ImageView(image, grey, camera, posture)
        elapsed_s = self._elapsed(stamp_ns)
        expected = [face for face in self._faces if view.shows(face)]
        for face in expected:
            face.missed_s += elapsed_s
        for found in self._find_faces(view, expected):
            self._update_track(found, view, expected)
        self._forget(expected)
        present = [
            face
            for face in self._faces
            if face.missed_s <= self._config.hold_face_s and view.shows(face)
        ]
        if self._caregiver is None and present:
            self._caregiver = max(present, key=lambda face: view.box(face).area)
        return sorted(present, key=lambda face: (face is not self._caregiver, face.track_id))

    def _elapsed(self, stamp_ns: int) -> float:
        before, self._stamp_ns = self._stamp_ns, stamp_ns
        if before is None:
            return 0.0
        if stamp_ns < before:
            self._faces.clear()
            self._caregiver = None
            return 0.0
        return (stamp_ns - before) / NS_PER_S

    def _find_faces(self, view: _ImageView, expected: list[FaceTrack]) -> list[Face]:
        height, width = view.grey.shape
        whole = whole_square(width, height)
        squares: list[Box] = []
        caregiver = self._caregiver
        if caregiver is not None and caregiver in expected:
            box = view.box(caregiver)
            if caregiver.is_unchanged(view.grey, box):
                caregiver.missed_s = 0.0
            else:
                squares.append(search_square(box, whole))
        if self._scan_is_due(expected, busy=bool(squares)):
            places = scan_squares(width, height, self._smallest_square(width))
            self._scan_place = (self._scan_place + 1) % len(places)
            if places[self._scan_place] not in squares:
                squares.append(places[self._scan_place])
        known = [view.box(face) for face in expected]
        found: list[Face] = []
        for square in squares:
            for face in self._finder.find_faces(view.image, square):
                if any(face.box.overlap(box) > _SAME_OVERLAP for box in known):
                    found.append(face)
                else:
                    found += self._confirm_new_face(view.image, face, square, whole)
        return suppress_non_maxima(found)

    def _smallest_square(self, width: int) -> float:
        smallest_px = max(self._config.smallest_face_share * width, _LEAST_FACE_PX)
        return smallest_px / self._finder.smallest_share

    def _scan_is_due(self, expected: list[FaceTrack], busy: bool) -> bool:
        """Return whether this image gets a scan: each one while the caregiver is not found.

        Otherwise every ``scan_every`` images get one. A scan waits while she is searched for
        (``busy``), as many images again at most: searches are what an image costs, and the slowest
        image decides how late a command can be.
        """
        caregiver, period = self._caregiver, self._config.scan_every
        lost = caregiver is None or (
            caregiver in expected and caregiver.missed_s > self._config.hold_face_s
        )
        self._until_scan -= 1
        longest_wait = period if busy else 0
        if lost or self._until_scan < -longest_wait:
            self._until_scan = period - 1
            return True
        return False

    def _confirm_new_face(
        self, image: NDArray[np.uint8], face: Face, square: Box, whole: Box
    ) -> list[Face]:
        """Search again for a new face, in a square that frames it well; return what is found."""
        least = self._config.new_face_score
        if face.score < least:
            return []
        framed = search_square(face.box, whole)
        again = [face] if framed == square else self._finder.find_faces(image, framed)
        return [f for f in again if f.box.overlap(face.box) > _SAME_OVERLAP and f.score >= least]

    def _update_track(self, face: Face, view: _ImageView, expected: list[FaceTrack]) -> None:
        overlaps = [face.box.overlap(view.box(known)) for known in expected]
        if overlaps and max(overlaps) > _SAME_OVERLAP:
            track = expected[overlaps.index(max(overlaps))]
        else:
            track = FaceTrack(self._next_id)
            self._next_id += 1
            self._faces.append(track)
        camera = view.camera
        ray = camera.rays((face.box.u, face.box.v))
        size = (face.box.width / camera.fx, face.box.height / camera.fy)
        direction = directions_of_rays(view.posture, ray)
        track.update(direction, size, face.score, self._config.face_averaging)
        track.store_picture(view.grey, view.box(track))

    def _forget(self, expected: list[FaceTrack]) -> None:
        gone = [face for face in expected if face.missed_s > self._config.forget_face_s]
        self._faces = [face for face in self._faces if face not in gone]
        if self._caregiver in gone:
            self._caregiver = None


def whole_square(width: int, height: int) -> Box:
    """Return the square that holds a whole image, concentric with it."""
    side = max(width, height)
    return Box((width - 1) / 2, (height - 1) / 2, side, side)


def search_square(face: Box, whole: Box) -> Box:
    """Return the square to search for a face that is expected in ``face``."""
    side = _SEARCH_WIDTHS * max(face.width, face.height)
    return whole if side > _NEARLY_WHOLE * whole.width else Box(face.u, face.v, side, side)


@lru_cache(maxsize=8)
def scan_squares(width: int, height: int, smallest: float) -> list[Box]:
    """Return overlapping squares that cover an image at several sizes, the largest first."""
    squares = [whole_square(width, height)]
    side = squares[0].width * _SCAN_STEP
    while side >= smallest:
        squares += [
            Box(u, v, side, side)
            for v in _centres_along(height, side)
            for u in _centres_along(width, side)
        ]
        side *= _SCAN_STEP
    return squares


def _centres_along(length: int, side: float) -> list[float]:
    """Return the centres of squares of ``side`` that cover ``length`` pixels with overlap."""
    if side >= length:
        return [(length - 1) / 2]
    count = 1 + int(np.ceil((length - side) / (side * (1 - _SCAN_OVERLAP))))
    return (np.linspace(side / 2, length - side / 2, count) - 0.5).tolist()
