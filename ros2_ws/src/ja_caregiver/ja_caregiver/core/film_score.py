"""The trials of a film with a schedule: what she looked at, what was proposed, what was fixated.

All that counts comes with the stamp of an image, so the trials of the same film and learner are
the same bit for bit. Which module has turned the head is found from the command alone: it is the
one whose proposal leads to the commanded posture.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ja_caregiver.core.film_session import SessionPhase
from ja_caregiver.core.meeting import MeetingTrial
from ja_caregiver.core.numbered_things import Direction, nearest_thing
from ja_caregiver.core.requests import RequestConfig
from ja_common.core.request_phase import RequestPhase

_CHANGED_RAD = 0.01
_LEARNER, _VISUAL_FEEDBACK = 'learner', 'visual feedback'
_SHIFTS = (_LEARNER, _VISUAL_FEEDBACK)


@dataclass(frozen=True)
class FilmImage:
    """What is known of one image, beside the picture.

    `trial`: number of the look, 0 before the first. `asked`: False in the pictures of the camera,
    before she is asked. `targets`: directions (2,) [rad] to which each module would turn the head
    ('learner', 'visual feedback', 'glance', 'face'); those without a proposal are missing.
    `command`, `fixation`: (2,) [rad].
    """

    stamp_ns: int
    trial: int
    phase: SessionPhase
    asked: bool
    thing: int
    things: dict[int, Direction]
    targets: Mapping[str, NDArray[np.float64]]
    command: NDArray[np.float64]
    fixation: NDArray[np.float64] | None = None


class FilmScore:
    """Cuts images into trials; `phase`, `asked`, `last` and `message` are for the page."""

    def __init__(self, trials: int, fixated_within_rad: float) -> None:
        self.config = RequestConfig(trials=trials, fixated_within_rad=fixated_within_rad)
        self.phase = RequestPhase.STARTING
        self.asked: int | None = None
        self.shift_began = False
        """Whether the first shift of the trial began on the last image."""
        self.fixated = False
        """Whether the fixation that ends the trial was on the last image."""
        self._last: MeetingTrial | None = None
        self._done = 0
        self._under_way: MeetingTrial | None = None
        self._answered = False
        self._shifted = False
        self._command = np.full(2, math.inf)

    @property
    def last(self) -> MeetingTrial | None:
        """Return the last trial with an answer, or that was given up; None before the first."""
        return self._under_way if self._answered else self._last

    @property
    def trials_done(self) -> int:
        """Return how many trials have an answer, or were given up."""
        return self._done + self._answered

    @property
    def message(self) -> str:
        """Return the sentence that the page shows."""
        if self.phase is RequestPhase.THING:
            return f'She looks at thing {self.asked}.'
        if self.phase is RequestPhase.ANSWER and self._under_way is not None:
            right = 'right' if self._under_way.success else 'wrong'
            return f'The head looks at thing {self._under_way.fixated or "none"}: {right}.'
        return {
            RequestPhase.STARTING: 'The film starts when the head looks at her.',
            RequestPhase.ENDED: 'The film has ended.',
            RequestPhase.PAUSED: 'Paused.',
        }.get(self.phase, 'She looks at the camera.')

    def pause(self, pauses: bool) -> None:
        """Show that the film stands still, or goes on."""
        before, self.phase = self.phase, RequestPhase.PAUSED
        if pauses and before is not RequestPhase.PAUSED:
            self._before_pause = before
        elif not pauses:
            self.phase = self._before_pause if before is RequestPhase.PAUSED else before

    def observe_image(self, image: FilmImage) -> MeetingTrial | None:
        """Take one image; return the trial that has ended, when the next one begins."""
        ended = None
        self.shift_began = self.fixated = False
        if self._under_way is None or image.trial != self._under_way.trial:
            ended = self._start_trial(image)
        if self._under_way is not None:
            self._follow_head(self._under_way, image)
        self._command = image.command
        self._set_phase(image)
        return ended

    def _start_trial(self, image: FilmImage) -> MeetingTrial | None:
        """Return the trial before, if there was one, and start that of this image."""
        ended, self._under_way = self._under_way, None
        if ended is not None:
            self._done += 1
            self._last = ended
        self._shifted = self._answered = False
        if image.trial > 0 and image.phase is not SessionPhase.ENDED:
            self._under_way = MeetingTrial(image.trial, image.stamp_ns, image.thing, image.things)
        return ended

    def _follow_head(self, trial: MeetingTrial, image: FilmImage) -> None:
        module = self._turned_by(image)
        if module in _SHIFTS and not self._answered:
            self.shift_began = not self._shifted
            if self.shift_began:
                target = image.targets.get(_LEARNER)
                proposed = None if target is None else nearest_thing(trial.things, target)
                trial = replace(trial, stamp_ns=image.stamp_ns, proposed=proposed)
            self._shifted = True
            trial = replace(trial, followed_learner=module == _LEARNER)
        if image.fixation is not None and self._shifted and not self._answered:
            within = self.config.fixated_within_rad
            self._answered = self.fixated = True
            trial = replace(trial, fixated=nearest_thing(trial.things, image.fixation, within))
        self._under_way = trial

    def _turned_by(self, image: FilmImage) -> str | None:
        """Return the module that has turned the head on this image; None where it stays."""
        change = np.abs(image.command - self._command).max()
        if not image.targets or not math.isfinite(change) or change < _CHANGED_RAD:
            return None
        return min(
            image.targets,
            key=lambda name: float(np.hypot(*(image.targets[name] - image.command))),
        )

    def _set_phase(self, image: FilmImage) -> None:
        self.asked = image.thing if image.trial > 0 else None
        if image.phase is SessionPhase.ENDED:
            self.phase = RequestPhase.ENDED
        elif image.trial == 0:
            self.phase = RequestPhase.STARTING
        elif self._answered:
            self.phase = RequestPhase.ANSWER
        else:
            self.phase = RequestPhase.THING if image.asked else RequestPhase.CAMERA
