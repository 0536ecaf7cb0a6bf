"""Tracks faces from image to image: where to search for them, and which is the caregiver's.

A face is stored by its direction from the base, so that the head's own motion does not lose it.
An image is searched where the caregiver is expected, unless her face is unchanged, and in the next
square of a scan that covers the picture in several sizes. That is one search an image; two where
she is missing, or where the scan has waited for long.

Which person is the caregiver is decided once. Where her face may have been confused with another
(it jumped, or another is near), her appearance decides; by it she is found again after an absence.
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
from ja_perception.core.person_appearance import (
    SAME_PERSON,
    SURELY_OTHER,
    KnownPerson,
    Signature,
    read_signature,
)

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
# A face that is found farther away than this from one image to the next (in face widths), or
# nearer to another than this, may be another person's.
_JUMP_WIDTHS = 0.5
_NEAR_WIDTHS = 1.5
# So may one that was not seen for longer than this: while the head looked elsewhere.
_UNSEEN_S = 0.3
# So many other people are remembered, not to be taken for the caregiver.
_MOST_STRANGERS = 5
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
    keep_caregiver_s: float = parameter(
        10.0, 'time without the caregiver for which no other person is taken for her',
        low=0.0, high=3600.0,
    )  # fmt: skip
    new_caregiver_after_s: float = parameter(
        3.0, 'time for which another person must then be seen to become the caregiver',
        low=0.0, high=3600.0,
    )  # fmt: skip


@dataclass(frozen=True)
class PeopleSeen:
    """Who is before the head, as far as the faces show it.

    ``caregiver_in_view``: her face is among those of this image. ``caregiver_expected``: it is
    not, but she is where the image does not show. ``others``: faces of other people in the image.
    ``unseen_s``: time for which she is missing [s], 0 while she is in view or expected.
    ``caregivers``: how many people have been the caregiver so far, each for some time.
    """

    caregiver_in_view: bool = False
    caregiver_expected: bool = False
    others: int = 0
    unseen_s: float = 0.0
    caregivers: int = 0

    def describe(self) -> str:
        """Return it in a sentence."""
        others = f'{self.others} other {"person" if self.others == 1 else "people"}'
        if self.caregiver_in_view:
            return f'I see the caregiver and {others}' if self.others else 'I see the caregiver'
        if self.caregiver_expected:
            return 'the caregiver is out of view'
        if self.others:
            return f'I see {others}, but not the caregiver, for {self.unseen_s:.0f} s'
        return f'I see no person, for {self.unseen_s:.0f} s'


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
        self.person = KnownPerson()
        """What the person looks like."""
        self.seen_s = 0.0
        """Time for which it has been seen without a gap."""
        self.found_ns = 0
        """Stamp of the image in which it was last found, or looked the same."""

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

    def has_jumped(self, direction: ArrayLike, size: ArrayLike) -> bool:
        """Return whether a detection is not where this face was, or of another size."""
        far = _JUMP_WIDTHS * self._size[0]
        resized = abs(float(np.asarray(size)[0]) - self._size[0]) > _OTHER_SIZE * self._size[0]
        return bool(angle_between(direction, self._direction) > far) or resized

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
    stamp_ns: int

    def box(self, face: FaceTrack) -> Box:
        """Return the box of a face in this image [px]."""
        return face.box(self.camera, self.posture)

    def shows(self, face: FaceTrack) -> bool:
        """Return whether the place of a face lies in this image."""
        return self.camera.contains(self.camera.pixels(face.ray(self.posture)))


@dataclass(frozen=True)
class _Sighting:
    """A face in an image: where it is, how large (at unit focal length), what it looks like."""

    face: Face
    direction: NDArray[np.float64]
    size: tuple[float, float]
    signature: Signature


class FaceTracker:
    """Finds faces in image after image with any ``FaceFinder``."""

    def __init__(self, finder: FaceFinder, config: FaceConfig) -> None:
        self._finder = finder
        self._config = config
        self._faces: list[FaceTrack] = []
        self._caregiver: FaceTrack | None = None
        # Of people who were seen together with her, or when she was known to be elsewhere.
        self._strangers: list[KnownPerson] = []
        self._absent_s = 0.0
        self._caregivers = 0
        self._next_id = 0
        self._scan_place = -1
        self._until_scan = 0
        self._scans_an_other = False
        self._stamp_ns: int | None = None
        self.people = PeopleSeen()
        """Who was seen in the last image."""

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
        caregiver is the largest face when none was known. She stays it while she is gone, until
        another person was seen for ``new_caregiver_after_s`` after ``keep_caregiver_s``; whether
        her face is among those returned is in ``people``.
        """
        view = _ImageView(image, grey, camera, posture, stamp_ns)
        elapsed_s = self._elapsed(stamp_ns)
        expected = [face for face in self._faces if view.shows(face)]
        for face in expected:
            face.missed_s += elapsed_s
        self._absent_s += elapsed_s
        self._update_tracks(self._find_faces(view, expected), view, expected, elapsed_s)
        self._forget(expected)
        present = [face for face in self._faces if view.shows(face) and self._is_held(face)]
        self._choose_caregiver(present, view)
        self._describe(present)
        return sorted(present, key=lambda face: (face is not self._caregiver, face.track_id))

    def _is_held(self, face: FaceTrack) -> bool:
        """Return whether a face counts as seen; others are searched for less often than hers."""
        other = self._caregiver is not None and face is not self._caregiver
        if other and face.person.sightings > 1:
            return True  # until it is forgotten; one sighting alone may be an error
        return face.missed_s <= self._config.hold_face_s

    def _elapsed(self, stamp_ns: int) -> float:
        before, self._stamp_ns = self._stamp_ns, stamp_ns
        if before is None:
            return 0.0
        if stamp_ns < before:
            self._faces.clear()
            self._strangers.clear()
            self._caregiver = None
            self._absent_s, self._caregivers = 0.0, 0
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
                caregiver.missed_s, caregiver.found_ns = 0.0, view.stamp_ns
            else:
                squares.append(search_square(box, whole))
        elif caregiver is not None and expected and caregiver not in self._faces:
            # She may be one of those who are seen, or one of them may take her place.
            longest_missed = max(expected, key=lambda face: face.missed_s)
            squares.append(search_square(view.box(longest_missed), whole))
        if self._scan_is_due(expected, busy=bool(squares)):
            square = self._next_scan(view, expected, whole)
            if square not in squares:
                squares.append(square)
        known = [view.box(face) for face in expected]
        found: list[Face] = []
        for square in squares:
            for face in self._finder.find_faces(view.image, square):
                if any(face.box.overlap(box) > _SAME_OVERLAP for box in known):
                    found.append(face)
                else:
                    found += self._confirm_new_face(view.image, face, square, whole)
        return suppress_non_maxima(found)

    def _next_scan(self, view: _ImageView, expected: list[FaceTrack], whole: Box) -> Box:
        """Return the next place of the scan, or in turn that of another person who is known."""
        others = [face for face in expected if face is not self._caregiver and face.missed_s > 0]
        self._scans_an_other = bool(others) and not self._scans_an_other
        if self._scans_an_other:
            longest_missed = max(others, key=lambda face: face.missed_s)
            return search_square(view.box(longest_missed), whole)
        height, width = view.grey.shape
        places = scan_squares(width, height, self._smallest_square(width))
        self._scan_place = (self._scan_place + 1) % len(places)
        return places[self._scan_place]

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
        lost = caregiver not in self._faces or (
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

    def _update_tracks(
        self, found: list[Face], view: _ImageView, expected: list[FaceTrack], elapsed_s: float
    ) -> None:
        """Update the track of each face that was found, hers first; others get a new one."""
        sightings = [_sighting(face, view) for face in found]
        near = [_is_near_another(each, found, view, expected) for each in sightings]
        hers = self._find_her(sightings, near, view, expected)
        for index, each in enumerate(sightings):
            track = self._caregiver if index in hers else None
            if track is None:
                others = [face for face in expected if face is not self._caregiver]
                track = _best_overlap(each.face, others, view) or self._new_track(expected)
            assert track is not None
            gap = track.missed_s > self._config.hold_face_s
            track.seen_s = 0.0 if gap else track.seen_s + elapsed_s
            jumped = track.person.is_known and track.has_jumped(each.direction, each.size)
            face = each.face
            track.update(each.direction, each.size, face.score, self._config.face_averaging)
            track.found_ns = view.stamp_ns
            track.store_picture(view.grey, view.box(track))
            if not (jumped or near[index]) or not track.person.is_known:
                track.person.learn(each.signature)

    def _new_track(self, expected: list[FaceTrack]) -> FaceTrack:
        track = FaceTrack(self._next_id)
        self._next_id += 1
        self._faces.append(track)
        expected.append(track)
        return track

    def _find_her(
        self,
        sightings: list[_Sighting],
        near: list[bool],
        view: _ImageView,
        expected: list[FaceTrack],
    ) -> set[int]:
        """Return which of the sightings are of the caregiver."""
        caregiver = self._caregiver
        if caregiver is None:
            return set()
        hers: set[int] = set()
        if caregiver in expected:
            for index, each in enumerate(sightings):
                if self._is_at_her_place(each, near[index], view, expected):
                    hers.add(index)
            if hers or caregiver.missed_s == 0.0:
                return hers
        elif caregiver in self._faces:
            return set()  # she is expected where the image does not show
        if not caregiver.person.is_known:
            return set()
        # She is missing: any face may be hers.
        alike = [
            index for index, each in enumerate(sightings) if self._looks_like_her(each.signature)
        ]
        if not alike:
            return set()
        best = min(alike, key=lambda i: caregiver.person.difference(sightings[i].signature))
        self._return_to(sightings[best], view, expected)
        return {best}

    def _is_at_her_place(
        self, seen: _Sighting, near: bool, view: _ImageView, expected: list[FaceTrack]
    ) -> bool:
        """Return whether a face is where hers is expected, and hers as far as can be seen.

        Her appearance decides only where it may be another's: a turn of her head changes it, too.
        """
        caregiver = self._caregiver
        assert caregiver is not None
        if near:
            there = seen.face.box.overlap(view.box(caregiver)) > _SAME_OVERLAP
            return there and self._looks_like_her(seen.signature)
        if _best_overlap(seen.face, expected, view) is not caregiver:
            return False
        if caregiver.has_jumped(seen.direction, seen.size):
            return self._looks_like_her(seen.signature)
        unseen_s = (view.stamp_ns - caregiver.found_ns) / NS_PER_S
        if unseen_s <= _UNSEEN_S or not caregiver.person.is_known:
            return True
        return caregiver.person.difference(seen.signature) < SURELY_OTHER

    def _looks_like_her(self, seen: Signature) -> bool:
        """Return whether a face may be hers, and looks no more like a known stranger's."""
        caregiver = self._caregiver
        assert caregiver is not None
        if not caregiver.person.is_known:
            return True
        difference = caregiver.person.difference(seen)
        return difference <= SAME_PERSON and all(
            difference <= stranger.difference(seen)
            for stranger in self._strangers
            if stranger.is_known
        )

    def _return_to(self, seen: _Sighting, view: _ImageView, expected: list[FaceTrack]) -> None:
        """Continue her track where she was found again; what was tracked there was she."""
        caregiver = self._caregiver
        assert caregiver is not None
        others = [face for face in expected if face is not caregiver]
        same = _best_overlap(seen.face, others, view)
        if same is not None:
            self._faces.remove(same)
            expected.remove(same)
            self._strangers = [one for one in self._strangers if one is not same.person]
        if caregiver not in self._faces:
            self._faces.append(caregiver)
            expected.append(caregiver)

    def _forget(self, expected: list[FaceTrack]) -> None:
        gone = [face for face in expected if face.missed_s > self._config.forget_face_s]
        self._faces = [face for face in self._faces if face not in gone]
        caregiver = self._caregiver
        if caregiver is not None and caregiver in gone and not caregiver.person.is_known:
            # A passing error of the detector, or a passer-by.
            self._caregiver = None
            self._caregivers -= 1

    def _choose_caregiver(self, present: list[FaceTrack], view: _ImageView) -> None:
        """Choose the caregiver: once, and again only when she was gone for long."""
        caregiver = self._caregiver
        if caregiver is not None and caregiver in self._faces:
            self._absent_s = caregiver.missed_s if view.shows(caregiver) else 0.0
        candidates = [face for face in present if face.missed_s <= self._config.hold_face_s]
        if caregiver is not None:
            if self._absent_s <= self._config.keep_caregiver_s:
                return
            least_s = self._config.new_caregiver_after_s
            candidates = [
                face for face in candidates if face is not caregiver and face.seen_s >= least_s
            ]
        if not candidates:
            return
        if caregiver is not None and caregiver in self._faces:
            self._faces.remove(caregiver)
        self._caregiver = max(candidates, key=lambda face: view.box(face).area)
        self._caregivers += 1
        person = self._caregiver.person
        self._strangers = [one for one in self._strangers if one is not person]
        self._absent_s = 0.0

    def _describe(self, present: list[FaceTrack]) -> None:
        caregiver = self._caregiver
        in_view = caregiver in present
        if in_view:
            # These are not she, whatever they look like.
            for face in present:
                if face is not caregiver and face.person not in self._strangers:
                    self._strangers = [*self._strangers[1 - _MOST_STRANGERS :], face.person]
        self.people = PeopleSeen(
            caregiver_in_view=in_view,
            caregiver_expected=not in_view and caregiver in self._faces and self._absent_s == 0.0,
            others=len(present) - in_view,
            unseen_s=0.0 if in_view else self._absent_s,
            caregivers=self._caregivers,
        )


def _sighting(face: Face, view: _ImageView) -> _Sighting:
    camera, box = view.camera, face.box
    ray = camera.rays((box.u, box.v))
    size = (box.width / camera.fx, box.height / camera.fy)
    direction = directions_of_rays(view.posture, ray)
    return _Sighting(face, direction, size, read_signature(view.image, view.grey, box))


def _best_overlap(face: Face, tracks: list[FaceTrack], view: _ImageView) -> FaceTrack | None:
    """Return the track that a face overlaps most, or None if it is new."""
    shares = [face.box.overlap(view.box(track)) for track in tracks]
    if not shares or max(shares) <= _SAME_OVERLAP:
        return None
    return tracks[shares.index(max(shares))]


def _is_near_another(
    seen: _Sighting, found: list[Face], view: _ImageView, expected: list[FaceTrack]
) -> bool:
    """Return whether another face is near, or two are expected there."""
    box = seen.face.box
    reach = _NEAR_WIDTHS * box.width
    if any(
        other is not seen.face and np.hypot(other.box.u - box.u, other.box.v - box.v) < reach
        for other in found
    ):
        return True
    places = [view.box(track) for track in expected]
    return sum(np.hypot(place.u - box.u, place.v - box.v) < reach for place in places) > 1


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
