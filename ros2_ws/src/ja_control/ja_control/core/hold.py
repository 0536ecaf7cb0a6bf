"""Why the head is held."""

from dataclasses import dataclass
from enum import Enum

from ja_common.core.health import Level


class Cause(Enum):
    """Why the head is held."""

    OTHER_COMMANDER = 'another node commands the head'
    DISABLED = 'disabled'
    BLOCKED = 'blocked'
    WAITING = 'waiting'
    SILENT = 'silent'
    STALE_IMAGE = 'stale image'
    STALE_JOINTS = 'stale joint states'
    OUTSIDE = 'outside the limits'
    STALLED = 'stalled'


@dataclass(frozen=True)
class Hold:
    """Why the head is held, in one sentence."""

    cause: Cause
    text: str

    @property
    def level(self) -> Level:
        """Return ERROR where a person must act, else WARN."""
        needs_a_person = (Cause.OTHER_COMMANDER, Cause.OUTSIDE, Cause.STALLED)
        return Level.ERROR if self.cause in needs_a_person else Level.WARN
