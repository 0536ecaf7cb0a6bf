"""Keeps an eye on faces from image to image: where to look for them, and which is the caregiver's.

A face is remembered by its direction from the base, so that the head's own motion does not lose
it. At most two looks are spent on an image: one at the caregiver, one at the next place of a scan
that goes round the picture in squares of several sizes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import parameter
from ja_common.core.geometry import angle_between, directions_of_rays, rays_of_directions
from ja_common.core.posture import NS_PER_S
from ja_perception.core.box import Box
from ja_perception.core.camera_model import CameraModel
from ja_perception.core.faces import Face, FaceFinder, without_doubles

# A look at a known face takes this many face widths, which is what the detectors are trained on.
_LOOK_WIDTHS = 2.5
# A look that would take more than this share of the picture takes the whole.
_NEARLY_WHOLE = 0.6
# A square of the scan is this many times smaller than the next larger one.
_SCAN_STEP = 0.6
_SCAN_OVERLAP = 0.3
# Sightings that share more than this are of one face.
_SAME_OVERLAP = 0.3
# The head is taken to have moved when a sighting lies farther off than this (in face widths).
_MOVED_WIDTHS = 0.5


@dataclass(frozen=True)
class FaceConfig:
    """How faces are searched for and remembered."""

    new_face_score: float = parameter(
        0.7, 'confidence that a face needs in two looks to be taken for one', low=0.0, high=1.0
    )
    smallest_scan_px: int = parameter(
        200, 'side of the smallest square searched for faces', low=32, high=4096
    )
    scan_every: int = parameter(
        5, 'images from one scanning look to the next while the caregiver is known',
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
        20, 'sightings over which the place of a resting head is averaged', low=1, high=1000
    )


class WatchedFace:
    """A face over time: where it was last seen, and the steadier place of the head."""

    def __init__(self, track_id: int) -> None:
        self.track_id = track_id
        self.score = 0.0
        self.missed_s = 0.0
        """Time in view since it was last found."""
        self._direction = np.zeros(2)
        self._size = np.zeros(2)
        self._sightings = 0

    def sight(
        self, direction: NDArray[np.float64], size: NDArray[np.float64], score: float, longest: int
    ) -> None:
        """Take in a sighting: direction [rad] and box size (width, height) at unit focal length.

        While the head stays, place and size are the mean of the last ``longest`` sightings or so:
        the box of a detector jitters, and follows the nose when the head turns, but the picture
        that the learner sees must not move with it. A head that went elsewhere starts anew.
        """
        away = angle_between(direction, self._direction)
        if self._sightings and away > _MOVED_WIDTHS * self._size[0]:
            self._sightings = 0
        self._sightings = min(self._sightings + 1, longest)
        share = 1 / self._sightings
        self._direction = self._direction + share * (direction - self._direction)
        self._size = self._size + share * (size - self._size)
        self.score, self.missed_s = score, 0.0

    @property
    def direction(self) -> NDArray[np.float64]:
        """Direction (pan, tilt) [rad] of the head."""
        return self._direction

    def ray(self, posture: ArrayLike) -> NDArray[np.float64]:
        """Ray (x, y) to the head from a posture; NaN when behind."""
        return rays_of_directions(posture, self._direction)

    def box(self, camera: CameraModel, posture: ArrayLike) -> Box:
        """Where the head is seen from a posture [px]; NaN when behind."""
        u, v = camera.pixels(self.ray(posture))
        width, height = self._size * (camera.fx, camera.fy)
        return Box(float(u), float(v), float(width), float(height))


class FaceWatch:
    """Finds faces in image after image with any ``FaceFinder``."""

    def __init__(self, finder: FaceFinder, config: FaceConfig) -> None:
        self._finder = finder
        self._config = config
        self._faces: list[WatchedFace] = []
        self._caregiver: WatchedFace | None = None
        self._next_id = 0
        self._scan_place = 0
        self._until_scan = 0
        self._stamp_ns: int | None = None

    def look(
        self, image: NDArray[np.uint8], camera: CameraModel, posture: ArrayLike, stamp_ns: int
    ) -> list[WatchedFace]:
        """The faces in view of an (H, W, 3) RGB image, the caregiver's first.

        ``posture`` (pan, tilt) [rad] at the image's stamp. The caregiver is the largest face when
        none was known, and stays so until her face is forgotten.
        """
        elapsed_s = self._elapsed(stamp_ns)
        expected = self._in_view(camera, posture)
        found = self._found(image, camera, posture, expected)
        for face in expected:
            face.missed_s += elapsed_s
        for sighting in found:
            self._sight(sighting, camera, posture, expected)
        self._forget(expected)
        present = self._in_view(camera, posture)
        present = [f for f in present if f.missed_s <= self._config.hold_face_s]
        if self._caregiver is None and present:
            self._caregiver = max(present, key=lambda f: f.box(camera, posture).area)
        return sorted(present, key=lambda f: (f is not self._caregiver, f.track_id))

    def _elapsed(self, stamp_ns: int) -> float:
        before, self._stamp_ns = self._stamp_ns, stamp_ns
        if before is None:
            return 0.0
        if stamp_ns < before:
            self._faces.clear()
            self._caregiver = None
            return 0.0
        return (stamp_ns - before) / NS_PER_S

    def _in_view(self, camera: CameraModel, posture: ArrayLike) -> list[WatchedFace]:
        return [f for f in self._faces if camera.contains(camera.pixels(f.ray(posture)))]

    def _found(
        self,
        image: NDArray[np.uint8],
        camera: CameraModel,
        posture: ArrayLike,
        expected: list[WatchedFace],
    ) -> list[Face]:
        found: list[Face] = []
        whole = whole_square(image)
        squares: list[Box] = []
        if self._caregiver in expected:
            squares.append(look_at(self._caregiver.box(camera, posture), whole))
        if self._scan_is_due():
            places = scan_squares(image, self._smallest_scan(image))
            self._scan_place = (self._scan_place + 1) % len(places)
            if places[self._scan_place] not in squares:
                squares.append(places[self._scan_place])
        for square in squares:
            for face in self._finder.find(image, square):
                if self._is_known(face, camera, posture, expected):
                    found.append(face)
                else:
                    found += self._second_look(image, face, square, whole)
        return without_doubles(found)

    def _smallest_scan(self, image: NDArray[np.uint8]) -> int:
        return min(self._config.smallest_scan_px, max(image.shape[:2]))

    def _scan_is_due(self) -> bool:
        if self._caregiver is None or self._until_scan <= 0:
            self._until_scan = self._config.scan_every - 1
            return True
        self._until_scan -= 1
        return False

    def _is_known(
        self, face: Face, camera: CameraModel, posture: ArrayLike, expected: list[WatchedFace]
    ) -> bool:
        return any(face.box.overlap(f.box(camera, posture)) > _SAME_OVERLAP for f in expected)

    def _second_look(
        self, image: NDArray[np.uint8], face: Face, square: Box, whole: Box
    ) -> list[Face]:
        """A face seen for the first time must be seen again, framed as faces are at best."""
        least = self._config.new_face_score
        if face.score < least:
            return []
        framed = look_at(face.box, whole)
        again = [face] if framed == square else self._finder.find(image, framed)
        return [f for f in again if f.box.overlap(face.box) > _SAME_OVERLAP and f.score >= least]

    def _sight(
        self, face: Face, camera: CameraModel, posture: ArrayLike, expected: list[WatchedFace]
    ) -> None:
        track = max(expected, key=lambda f: face.box.overlap(f.box(camera, posture)), default=None)
        if track is None or face.box.overlap(track.box(camera, posture)) <= _SAME_OVERLAP:
            track = WatchedFace(self._next_id)
            self._next_id += 1
            self._faces.append(track)
        ray = camera.rays((face.box.u, face.box.v))
        size = np.array([face.box.width / camera.fx, face.box.height / camera.fy])
        direction = directions_of_rays(posture, ray)
        track.sight(direction, size, face.score, self._config.face_averaging)

    def _forget(self, expected: list[WatchedFace]) -> None:
        gone = [f for f in expected if f.missed_s > self._config.forget_face_s]
        self._faces = [f for f in self._faces if f not in gone]
        if self._caregiver in gone:
            self._caregiver = None


def whole_square(image: NDArray[np.uint8]) -> Box:
    """The square that holds the whole image, concentric with it."""
    height, width = image.shape[:2]
    side = max(width, height)
    return Box((width - 1) / 2, (height - 1) / 2, side, side)


def look_at(face: Box, whole: Box) -> Box:
    """The square to search for a face that is expected in ``face``."""
    side = _LOOK_WIDTHS * max(face.width, face.height)
    return whole if side > _NEARLY_WHOLE * whole.width else Box(face.u, face.v, side, side)


def scan_squares(image: NDArray[np.uint8], smallest: float) -> list[Box]:
    """Squares that cover the image at several sizes, overlapping, the largest first."""
    height, width = image.shape[:2]
    squares = [whole_square(image)]
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
    """Centres of squares of ``side`` that cover ``length`` pixels with overlap."""
    if side >= length:
        return [(length - 1) / 2]
    count = 1 + int(np.ceil((length - side) / (side * (1 - _SCAN_OVERLAP))))
    return (np.linspace(side / 2, length - side / 2, count) - 0.5).tolist()
