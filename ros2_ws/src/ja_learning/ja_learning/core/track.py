"""The track of a learner: what it starts from. Tracks are never mixed in one table.

`strict`: random initial weights and own trials only. The face detector is innate, as in the paper
(Nagai et al. 2003). `self-supervised`: the same, and a face code learned from watching her,
without labels (`watched_face_code`). `synthetic others`: the same, and a face code learned from
the candidate sets of other, simulated caregivers (`others_face_code`). `landmarks`: foreign
weights read her face (`face_gaze`). Each may be with depth: the learner has used ranges. A track
is what a learner has really used, so it can only gain depth while the learner learns, and a
learner that never received a range has none.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from ja_common.core.config import Configuration, parameter
from ja_common.core.detection import Detection
from ja_common.core.weight_files import changed_weight_files

_WITH_DEPTH = ' with depth'


class Start(str, Enum):
    """What the eyes and the learner have before the first trial."""

    STRICT = 'strict'
    SELF_SUPERVISED = 'self-supervised'
    SYNTHETIC_OTHERS = 'synthetic others'
    LANDMARKS = 'landmarks'


_START_OF_READER = {'pixels': Start.STRICT, 'landmarks': Start.LANDMARKS}
# A learner that reads pixels, by its first guess.
_START_OF_GUESS = {
    'none': Start.STRICT,
    'eigenfaces': Start.STRICT,
    'watched': Start.SELF_SUPERVISED,
    'others': Start.SYNTHETIC_OTHERS,
}


@dataclass(frozen=True)
class Track:
    """A start, with or without depth; as text `strict`, `landmarks with depth`, ..."""

    start: Start = Start.STRICT
    depth: bool = False

    def __str__(self) -> str:
        return self.start.value + _WITH_DEPTH * self.depth

    def with_depth(self) -> 'Track':
        """Return this track with depth."""
        return replace(self, depth=True)

    @staticmethod
    def parse(text: str) -> 'Track':
        """Return the track of a text. Raises ValueError when it is none."""
        start = text.removesuffix(_WITH_DEPTH)
        try:
            return Track(Start(start), depth=start != text)
        except ValueError:
            raise ValueError(f'{text[:50]!r} is no track: {", ".join(map(str, TRACKS))}') from None

    @staticmethod
    def of_learner(config: Any, depth: bool = False) -> 'Track':
        """Return the track of a learner by its configuration, `depth` if it has used ranges.

        A learner that reads no faces in several ways (no `face_reader`), the paper's, reads
        pixels and uses no ranges. Raises ValueError for a reader or a first guess that has no
        track.
        """
        reader = getattr(config, 'face_reader', None)
        if reader is None:
            return Track()
        if reader not in _START_OF_READER:
            raise ValueError(f'face_reader {reader!r} has no track: name one in {__name__}')
        start = _START_OF_READER[reader]
        if start is Start.STRICT:
            guess = getattr(config, 'first_guess', 'none')
            if guess not in _START_OF_GUESS:
                raise ValueError(f'first_guess {guess!r} has no track: name one in {__name__}')
            start = _START_OF_GUESS[guess]
        return Track(start, depth)


TRACKS = tuple(Track(start, depth) for start in Start for depth in (False, True))


@dataclass(frozen=True)
class TrackConfig(Configuration):
    """What a learner may use beside her face and the directions of things."""

    use_ranges: bool = parameter(
        False,
        'use the ranges of detections, where they have any: the track is then with depth, and '
        'checkpoints of a learner without ranges are not resumed',
    )


class Origin:
    """What the learner of a node may use, and what it has really used so far."""

    def __init__(self, config: TrackConfig | None = None) -> None:
        self._may_use_ranges = (config or TrackConfig()).use_ranges
        self._used_ranges = False
        self._learned_with: dict[str, str] = {}
        self._weight_files: dict[str, str] = {}
        self._code_files: dict[str, str] = {}

    def reset(self) -> None:
        """Forget what a learner has used that knows nothing any more."""
        self._used_ranges, self._learned_with = False, {}

    def allowed(self, detections: list[Detection]) -> list[Detection]:
        """Return the detections with the ranges that the learner may use, and note that it does.

        Whether it may is fixed at the start: ranges that a detector happens to publish do not
        change the track.
        """
        known = [each for each in detections if np.isfinite(each.range_m)]
        if known and not self._may_use_ranges:
            return _without_ranges(detections)
        self._used_ranges = self._used_ranges or bool(known)
        return detections

    def set_weight_files(self, files: Mapping[str, str]) -> str:
        """Take the weight files, name -> SHA-256, that the eyes have opened.

        Returns in one clause how they differ from those that the learner has learned with; '' if
        they do not.
        """
        if self._weight_files:
            self._learned_with = self._weight_files | self._code_files
        self._weight_files = dict(files)
        return self.changed_weight_files()

    def set_code_files(self, files: Mapping[str, str]) -> None:
        """Take the weight files, name -> SHA-256, that the learner itself has opened."""
        self._code_files = dict(files)

    def changed_weight_files(self) -> str:
        """Return in one clause how the weight files differ from those before; '' if unknown."""
        if not (self._learned_with and self._weight_files):
            return ''
        return changed_weight_files(self._learned_with, self._weight_files | self._code_files)

    def track(self, config: Any) -> Track:
        """Return the track of a learner of this configuration: what it has really used."""
        return Track.of_learner(config, self._used_ranges)

    def describe(self, config: Any) -> dict[str, Any]:
        """Return what the checkpoint of a learner of this configuration keeps of its origin."""
        return {
            'track': str(self.track(config)),
            'track_allowed': str(Track.of_learner(config, self._may_use_ranges)),
            'weight_files': (self._weight_files or self._learned_with) | self._code_files,
        }

    def check(self, description: Mapping[str, Any], config: Any) -> None:
        """Raise ValueError when the checkpoint of this description is of another track."""
        found, allowed, _ = _read(description)
        wanted = Track.of_learner(config, self._may_use_ranges)
        if allowed != wanted or found.start != wanted.start:
            raise ValueError(
                f'it is of the track {allowed!s}, this learner is of the track {wanted!s}, and '
                'tracks are not mixed'
            )

    def resume(self, description: Mapping[str, Any]) -> None:
        """Continue from a checkpoint that was checked."""
        found, _, files = _read(description)
        self._used_ranges, self._learned_with = found.depth, files


def _read(description: Mapping[str, Any]) -> tuple[Track, Track, dict[str, str]]:
    """Return track, allowed track and weight files; those before there were tracks are strict."""
    texts = [description.get(name, str(Track())) for name in ('track', 'track_allowed')]
    files = description.get('weight_files', {})
    if not isinstance(files, dict) or not all(isinstance(each, str) for each in files.values()):
        raise ValueError('its weight_files are no names with a SHA-256')
    found, allowed = (Track.parse(str(text)) for text in texts)
    return found, allowed, files


def _without_ranges(detections: Iterable[Detection]) -> list[Detection]:
    nan = float('nan')
    return [each._replace(range_m=nan, range_deviation_m=nan) for each in detections]
