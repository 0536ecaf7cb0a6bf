"""A meeting with a real caregiver: its trials, its figures and its file.

Only the scorer knows what she was asked to look at. A trial is right if the head fixated that
thing; the learner alone is right if that thing is nearest to where the learner proposed to look.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from ja_common.core.files import write_file
from ja_common.core.safe_files import load_json
from ja_common.core.statistics import Rate

MEETING_FILE = 'meeting.json'
_FORMAT = 1


@dataclass(frozen=True)
class MeetingTrial:
    """One request and what followed.

    `asked`, `proposed`, `fixated`: numbers of things; None where the learner had no proposal, the
    trial was given up, or no thing with a number was fixated. `things`: number -> (pan, tilt)
    [rad] of each thing when she was looked at. `followed_learner`: the gate took the learner's
    proposal. Pictures: file names beside the meeting's file, '' where there are none.
    """

    trial: int
    stamp_ns: int
    asked: int
    things: dict[int, tuple[float, float]]
    proposed: int | None = None
    fixated: int | None = None
    followed_learner: bool = False
    face_picture: str = ''
    view_picture: str = ''

    @property
    def success(self) -> bool:
        """Return whether the head fixated what she was asked to look at."""
        return self.fixated == self.asked

    @property
    def learner_right(self) -> bool | None:
        """Return whether the learner alone was right; None without a proposal."""
        return None if self.proposed is None else self.proposed == self.asked

    @property
    def chance(self) -> float:
        """Return the success of choosing any of the things."""
        return 1 / max(len(self.things), 1)


@dataclass(frozen=True)
class Meeting:
    """All trials with one person, in order, and where they came from.

    `started`: date and time, ISO 8601. `source`: webcam, topics or film. `track`: of the learner.
    `ended`: why it ended, in words.
    """

    started: str
    source: str
    seed: int
    learner: str = ''
    track: str = ''
    ended: str = ''
    trials: tuple[MeetingTrial, ...] = field(default=())

    def learner_rate(self, part: slice = slice(None)) -> Rate:
        """Return how often the learner alone was right, among trials in which it proposed."""
        right = [each.learner_right for each in self.trials[part] if each.proposed is not None]
        return Rate(sum(map(bool, right)), len(right))

    def success_rate(self, part: slice = slice(None)) -> Rate:
        """Return how often the head fixated what she was asked to look at."""
        part_of = self.trials[part]
        return Rate(sum(each.success for each in part_of), len(part_of))

    def chance(self, part: slice = slice(None)) -> float:
        """Return the mean success of choosing any thing; NaN before the first trial."""
        part_of: Sequence[MeetingTrial] = self.trials[part]
        return sum(each.chance for each in part_of) / len(part_of) if part_of else float('nan')


def save_meeting(meeting: Meeting, folder: Path) -> Path:
    """Write a meeting into a folder, and return its file. Raises SaveError."""
    path = folder / MEETING_FILE
    write_file(path, json.dumps({'format': _FORMAT, **asdict(meeting)}, indent=1).encode())
    return path


def load_meeting(path: Path) -> Meeting:
    """Read a meeting's file. Raises ValueError or OSError, which say what is wrong with it."""
    found = load_json(path)
    if found.get('format') != _FORMAT:
        raise ValueError(f'{path}: no meeting of format {_FORMAT}: made by another version?')
    try:
        return _meeting(found)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ValueError(f'{path}: damaged meeting file: {error!r}') from None


def _meeting(found: dict[str, Any]) -> Meeting:
    names = {each.name for each in fields(Meeting)} - {'trials'}
    trials = tuple(_trial(each) for each in found['trials'])
    return Meeting(**{name: found[name] for name in names}, trials=trials)


def _trial(found: dict[str, Any]) -> MeetingTrial:
    things = {
        int(number): (float(pan), float(tilt)) for number, (pan, tilt) in found['things'].items()
    }
    return MeetingTrial(**{**found, 'things': things})
