"""Which picture of a film the head sees next: the film goes on only while the head looks at her.

A film cannot wait for the robot as a person does. So each look of its schedule is a clip. It is
played when the head looks at her, up to its end, where she looks at the thing; while the head then
glances, shifts and fixates, its last pictures are shown, forward and backward. When the head looks
at her again, the next clip follows. The session sees nothing but where the head points and where
her face was found.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ja_caregiver.core.film_clips import Clip, Picture
from ja_common.core.config import Configuration, parameter
from ja_common.core.geometry import angle_between

_LEFT_AFTER_TOLERANCES = 1.5
"""The head has looked away when it is this many tolerances off, as for the simulated caregiver."""


@dataclass(frozen=True)
class FilmSessionConfig(Configuration):
    """When the head looks at her, and what is shown while it does not."""

    eye_contact_rad: float = parameter(
        0.07, 'the head looks at her when it points this near to her face', low=0.01, high=0.5
    )
    held_s: float = parameter(
        0.5, 'so much of the end of a look is shown while the head looks elsewhere',
        low=0.0, high=10.0,
    )  # fmt: skip
    patience_s: float = parameter(
        3.0, 'a head that stays on her for so long after a look has the next one shown',
        low=0.1, high=600.0,
    )  # fmt: skip
    lost_s: float = parameter(
        10.0, 'after so long without her face she is shown looking at the camera again',
        low=0.1, high=600.0,
    )  # fmt: skip
    given_up_s: float = parameter(
        60.0, 'after so long without her face the next look is shown all the same',
        low=0.1, high=3600.0,
    )  # fmt: skip


class SessionPhase(Enum):
    """What a film with a schedule shows."""

    CAMERA = 0
    """She looks at the camera and waits for the head."""
    LOOK = 1
    """A look is played: from the camera to the thing."""
    HELD = 2
    """She keeps looking at the thing."""
    ENDED = 3
    """All looks have been shown."""


class FilmSession:
    """The state of a session; call `next_picture`, and then `observe` what the head saw in it."""

    def __init__(
        self,
        next_clip: Callable[[], Clip | None],
        rate_hz: float,
        config: FilmSessionConfig = FilmSessionConfig(),
    ) -> None:
        """`next_clip` returns the clip of the next look, None at the end of film or schedule.

        Raises ValueError where there is no look at all.
        """
        self._next_clip, self._config, self._step_s = next_clip, config, 1 / rate_hz
        self._held = max(1, round(config.held_s * rate_hz))
        clip = next_clip()
        if clip is None:
            raise ValueError('the film ends before its first look does')
        self._clip = clip
        self.phase = SessionPhase.CAMERA
        self.trial = 0
        """Number of the look that is shown or was shown last, from 1; one more at the end."""
        self._index = self._images = 0
        self._left = True
        self._face: NDArray[np.float64] | None = None

    @property
    def clip(self) -> Clip:
        """Return the clip of the look that is shown, or comes next before the first."""
        return self._clip

    @property
    def asked(self) -> bool:
        """Return whether she has been asked to look at the thing in the last picture."""
        if self.phase is SessionPhase.LOOK:
            return self._index >= self._clip.camera_pictures
        return self.phase is SessionPhase.HELD

    @property
    def face(self) -> NDArray[np.float64] | None:
        """Return where her face was found last, (2,) [rad]; None before the first time."""
        return self._face

    def next_picture(self) -> Picture:
        """Return the picture that the wide camera delivers next."""
        pictures = self._clip.pictures
        if self.phase is SessionPhase.LOOK:
            picture = pictures[self._index]
        elif self.phase is SessionPhase.CAMERA:
            picture = pictures[_to_and_fro(self._images, self._clip.camera_pictures)]
        else:
            count = min(self._held, self._index + 1)
            picture = pictures[self._index - _to_and_fro(self._images, count)]
        self._images += 1
        return picture

    def observe(
        self, posture: NDArray[np.float64], still: bool, face: NDArray[np.float64] | None
    ) -> None:
        """Take what the head saw in the last picture: its own posture and her face (2,) [rad].

        `still`: the head stood still. `face`: the direction of her face, None where none is seen.
        """
        tolerance = self._config.eye_contact_rad
        if face is not None:
            self._face = face
        off = np.inf if self._face is None else float(angle_between(posture, self._face))
        looks = face is not None and still and off < tolerance
        if self._face is not None and off > _LEFT_AFTER_TOLERANCES * tolerance:
            self._left = True
        {
            SessionPhase.CAMERA: self._wait,
            SessionPhase.LOOK: self._play,
            SessionPhase.HELD: self._hold,
            SessionPhase.ENDED: lambda looks: None,
        }[self.phase](looks)

    @property
    def _elapsed_s(self) -> float:
        return self._images * self._step_s

    def _wait(self, looks: bool) -> None:
        if looks or self._elapsed_s > self._config.given_up_s:
            self._start_look()

    def _play(self, looks: bool) -> None:
        last = self._index == len(self._clip.pictures) - 1
        if last or self._left:
            self._enter(SessionPhase.HELD)
        else:
            self._index += 1

    def _hold(self, looks: bool) -> None:
        stayed = not self._left and self._elapsed_s > self._config.patience_s
        lost = self._left and self._elapsed_s > self._config.lost_s
        if not (stayed or lost or (self._left and looks)):
            return
        clip = self._next_clip()
        if clip is None:
            self.trial += 1
            self._enter(SessionPhase.ENDED)
            return
        self._clip = clip
        if lost and not looks:
            self._enter(SessionPhase.CAMERA)
        else:
            self._start_look()

    def _start_look(self) -> None:
        self.trial += 1
        self._index, self._left = 0, False
        self._enter(SessionPhase.LOOK)

    def _enter(self, phase: SessionPhase) -> None:
        self.phase, self._images = phase, 0


def _to_and_fro(step: int, count: int) -> int:
    """Return 0, 1, ... count - 1, count - 2, ... 1, 0, 1, ...: no jump between two pictures."""
    if count < 2:
        return 0
    place = step % (2 * count - 2)
    return min(place, 2 * count - 2 - place)
